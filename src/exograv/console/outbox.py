"""What waits to be sent to one page: words that must arrive in order, and news of which only the latest matter."""

import asyncio
from collections import deque

WORDS_MAX = 256
"""Answers and acknowledgements; a page that lets more wait does not read any more."""

NEWS_MAX = 4
"""Of one topic: a page that is slow loses the oldest."""


class Outbox:
    """Filled by the server, emptied by the line's writer; filling never waits."""

    def __init__(self) -> None:
        """Empty."""
        self._words = deque[str]()
        self._news = dict[str, deque[str]]()
        self._filled = asyncio.Event()
        self.is_full = False
        """Whether words were lost; the line then has to end."""

        self.dropped = 0
        """News that were not sent."""

    def say(self, text: str) -> None:
        """A word that must arrive."""
        if len(self._words) >= WORDS_MAX:
            self.is_full = True
        else:
            self._words.append(text)
        self._filled.set()

    def show(self, topic: str, text: str) -> None:
        """News; the oldest of its topic makes room."""
        waiting = self._news.setdefault(topic, deque(maxlen=NEWS_MAX))
        self.dropped += len(waiting) == NEWS_MAX
        waiting.append(text)
        self._filled.set()

    async def next(self) -> str:
        """The next to be sent, when there is one."""
        while True:
            if self._words:
                return self._words.popleft()
            for waiting in self._news.values():
                if waiting:
                    return waiting.popleft()
            self._filled.clear()
            await self._filled.wait()
