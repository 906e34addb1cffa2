"""Messages that wait for one page: some must all arrive in order, of others only the latest are sent."""

import asyncio
from collections import deque

WORDS_MAX = 256
"""Largest number of waiting words (answers, acknowledgements). A page with more does not read any more."""

NEWS_MAX = 4
"""Largest number of waiting messages of one topic, of which only the latest matter. A slow page loses the oldest."""


class Outbox:
    """Queue that the server fills and the line's writer empties. Filling never waits."""

    def __init__(self) -> None:
        """Start without waiting messages."""
        self._words = deque[str]()
        self._news = dict[str, deque[str]]()
        self._filled = asyncio.Event()
        self.is_full = False
        """True if words were lost. The line must then end."""

        self.dropped = 0
        """Number of news that were not sent."""

    def say(self, text: str) -> None:
        """Add a word, which must arrive."""
        if len(self._words) >= WORDS_MAX:
            self.is_full = True
        else:
            self._words.append(text)
        self._filled.set()

    def show(self, topic: str, text: str) -> None:
        """Add a message of which only the latest matter. If the topic is full, its oldest message is dropped."""
        waiting = self._news.setdefault(topic, deque(maxlen=NEWS_MAX))
        self.dropped += len(waiting) == NEWS_MAX
        waiting.append(text)
        self._filled.set()

    async def next(self) -> str:
        """Wait for the next message to send, and return it."""
        while True:
            if self._words:
                return self._words.popleft()
            for waiting in self._news.values():
                if waiting:
                    return waiting.popleft()
            self._filled.clear()
            await self._filled.wait()
