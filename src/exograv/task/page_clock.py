"""The clock of the participant's page against the server's, from pings; with a bound that no network can break."""

from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from exograv.clock_fit import ClockFit, fit_clock

BLOCK_S = 5.0
"""Of these the ping with the shortest way counts: what waited in a queue has waited on one side of it only [s]."""

BLOCKS_MAX = 4000
"""Five hours and a half."""

DRIFT_MAX = 300e-6
"""Of two clocks of ordinary computers against each other [s/s]."""

WAY_MAX_S = 5.0
"""A ping that took longer says nothing."""


class PingTimes(NamedTuple):
    """One question of the page and its answer, on two clocks [s]."""

    asked: float
    """By the page."""

    heard: float
    answered: float
    """By the server."""

    back: float
    """By the page."""

    @property
    def half_way_s(self) -> float:
        """Half of the time that it was under way: as far as the offset may be wrong."""
        return 0.5 * ((self.back - self.asked) - (self.answered - self.heard))

    @property
    def offset_s(self) -> float:
        """Server minus page, if both ways were equally long."""
        return 0.5 * ((self.heard - self.asked) + (self.answered - self.back))

    @property
    def middle(self) -> float:
        """When it was asked, by the page."""
        return 0.5 * (self.asked + self.back)

    @property
    def is_possible(self) -> bool:
        """Whether four numbers can be a ping at all."""
        is_ordered = self.asked <= self.back and self.heard <= self.answered
        return bool(np.all(np.isfinite(self)) and is_ordered and 0.0 <= self.half_way_s <= 0.5 * WAY_MAX_S)


class ServerTime(NamedTuple):
    """A time on the server's clock."""

    t: float
    bound_s: float
    """By which it may be wrong, whatever the network does."""


@dataclass(frozen=True)
class PageClock:
    """What is known of one page's clock."""

    best: tuple[PingTimes, ...] = ()
    """Of each block, since the clock last jumped."""

    jumps: int = 0
    """How often what came did not fit to what had come: a tablet that slept, a clock that was set."""

    def with_ping(self, ping: PingTimes) -> "PageClock":
        """The same with one more; one that cannot be changes nothing."""
        if not ping.is_possible:
            return self
        if not self.best:
            return replace(self, best=(ping,))
        last = self.best[-1]
        apart = DRIFT_MAX * abs(ping.middle - last.middle) + ping.half_way_s + last.half_way_s
        if abs(ping.offset_s - last.offset_s) > apart:
            return PageClock((ping,), self.jumps + 1)
        if ping.middle - self.best[0].middle >= BLOCK_S * (self._blocks + 1):
            return replace(self, best=(*self.best, ping)[-BLOCKS_MAX:])
        better = min(ping, last, key=lambda one: one.half_way_s)
        return replace(self, best=(*self.best[:-1], better))

    def to_server(self, t_page: float) -> ServerTime | None:
        """A time of the page on the server's clock; None before the first ping."""
        if self._fit is None:
            return None
        middles, offsets, halves = self._arrays
        spread = halves + DRIFT_MAX * np.abs(t_page - middles)
        low, high = float(np.max(offsets - spread)), float(np.min(offsets + spread))
        likely = float(self._fit.correction(np.array([t_page]))[0])
        # Intervals that leave nothing mean a drift beyond what is believed; then the fit alone is left.
        offset = min(max(likely, low), high) if low <= high else likely
        return ServerTime(t_page + offset, max(offset - low, high - offset, low - high))

    @property
    def _blocks(self) -> int:
        return int((self.best[-1].middle - self.best[0].middle) // BLOCK_S)

    @cached_property
    def _fit(self) -> ClockFit | None:
        middles, offsets, _ = self._arrays
        return fit_clock(middles, offsets)

    @cached_property
    def _arrays(self) -> tuple[Float[np.ndarray, " block"], Float[np.ndarray, " block"], Float[np.ndarray, " block"]]:
        """Middle, offset and half way of the best pings [s]."""
        rows = np.array([(one.middle, one.offset_s, one.half_way_s) for one in self.best]).reshape(-1, 3)
        return rows[:, 0], rows[:, 1], rows[:, 2]
