"""The clocks of the pages that were opened, each fitted to ours by its pings."""

from dataclasses import dataclass, field

from exograv.task.page_clock import PageClock, PingTimes, ServerTime

from .messages import Ping

PAGES_MAX = 64
"""A page that was loaded anew has a new clock; touches of the old one may still come."""

ASKED_MAX = 16
"""Pings whose answers may still be on the way."""


@dataclass
class _Page:
    clock: PageClock = field(default_factory=PageClock)
    answered: dict[float, tuple[float, float]] = field(default_factory=dict)
    """By when they were asked: when they were heard and answered. What a page says about that is not believed."""


class PageClocks:
    """All of them, by page."""

    def __init__(self) -> None:
        """None."""
        self._pages = dict[str, _Page]()

    def ping(self, page: str, ping: Ping, heard: float, answered: float) -> None:
        """Note one that was heard at `heard` and is answered at `answered`; and what it says of an earlier one."""
        while len(self._pages) >= PAGES_MAX and page not in self._pages:
            del self._pages[next(iter(self._pages))]
        known = self._pages.setdefault(page, _Page())
        if ping.previous is not None and ping.previous.asked in known.answered:
            then = known.answered.pop(ping.previous.asked)
            known.clock = known.clock.with_ping(PingTimes(ping.previous.asked, *then, ping.previous.back))
        while len(known.answered) >= ASKED_MAX:
            del known.answered[next(iter(known.answered))]
        known.answered[ping.asked] = heard, answered

    def place(self, page: str, at: float) -> ServerTime | None:
        """A time of that page on our clock; None where nothing is known of it."""
        known = self._pages.get(page)
        return None if known is None else known.clock.to_server(at)
