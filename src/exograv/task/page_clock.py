"""Clock of the participant's page relative to the server's, from pings, with an error bound for any network delay."""

from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from exograv.clock_fit import ClockFit, fit_clock

BLOCK_S = 5.0
"""Length of a block of pings [s].

Only the ping with the shortest round trip counts: queues delay one direction only.
"""

BLOCKS_MAX = 4000
"""Upper limit of the stored blocks: five hours and a half."""

DRIFT_MAX = 300e-6
"""Largest drift between the clocks of two ordinary computers [s/s]."""

WAY_MAX_S = 5.0
"""Longest round trip of a usable ping [s]."""


class PingTimes(NamedTuple):
    """Times of one ping on two clocks [s]."""

    asked: float
    """Time at which the page sent the ping, on the page's clock [s]."""

    heard: float
    answered: float
    """Times at which the server received the ping (`heard`) and answered it, on the server's clock [s]."""

    back: float
    """Time at which the page received the answer, on the page's clock [s]."""

    @property
    def half_way_s(self) -> float:
        """Half of the time in transit [s]. The offset is at most this far from the true one."""
        return 0.5 * ((self.back - self.asked) - (self.answered - self.heard))

    @property
    def offset_s(self) -> float:
        """Server time minus page time [s], if both directions took equally long."""
        return 0.5 * ((self.heard - self.asked) + (self.answered - self.back))

    @property
    def middle(self) -> float:
        """Page time in the middle between request and answer [s]."""
        return 0.5 * (self.asked + self.back)

    @property
    def is_possible(self) -> bool:
        """True if the four times can belong to a ping."""
        is_ordered = self.asked <= self.back and self.heard <= self.answered
        return bool(np.all(np.isfinite(self)) and is_ordered and 0.0 <= self.half_way_s <= 0.5 * WAY_MAX_S)


class ServerTime(NamedTuple):
    """Time on the server's clock with its error bound."""

    t: float
    bound_s: float
    """Upper limit of the error for any network delay [s]."""


@dataclass(frozen=True)
class PageClock:
    """Model of one page's clock."""

    best: tuple[PingTimes, ...] = ()
    """Best ping of each block since the last jump of the clock."""

    jumps: int = 0
    """Number of pings that contradicted the earlier ones: the tablet slept, or its clock was set."""

    def with_ping(self, ping: PingTimes) -> "PageClock":
        """Return the clock after one more ping. An impossible ping changes nothing."""
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
        """Time of the page on the server's clock; None before the first ping."""
        if self._fit is None:
            return None
        middles, offsets, halves = self._arrays
        spread = halves + DRIFT_MAX * np.abs(t_page - middles)
        low, high = float(np.max(offsets - spread)), float(np.min(offsets + spread))
        likely = float(self._fit.correction(np.array([t_page]))[0])
        # Intervals without intersection mean a drift above `DRIFT_MAX`. Then only the fit remains.
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
