"""Clocks of the opened pages, each fitted to the server's clock by its pings."""

from dataclasses import dataclass, field

from exograv.task.page_clock import PageClock, PingTimes, ServerTime

from .messages import Ping

PAGES_MAX = 64
"""Largest number of clocks. A reloaded page has a new clock, and touches of the old page may still come."""

ASKED_MAX = 16
"""Largest number of pings of a page whose answers may still be on the way."""


@dataclass
class _Page:
    clock: PageClock = field(default_factory=PageClock)
    answered: dict[float, tuple[float, float]] = field(default_factory=dict)
    """Arrival and answer of each ping by its time of asking. The server's own times are used, not those of the page."""


class PageClocks:
    """Clocks of the pages: offset and drift of each against the server's clock."""

    def __init__(self) -> None:
        """Start without the clock of any page."""
        self._pages = dict[str, _Page]()

    def ping(self, page: str, ping: Ping, heard: float, answered: float) -> None:
        """Record a ping with its arrival and answer [s], and update the fit by the earlier ping that it reports."""
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
        """Return a time of a page on the server's clock; None if the page's clock is unknown."""
        known = self._pages.get(page)
        return None if known is None else known.clock.to_server(at)
