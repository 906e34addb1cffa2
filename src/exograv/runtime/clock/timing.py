"""When the ticks of a live loop really ran: what every judgement about a computer's timing is made from."""

import enum
from dataclasses import dataclass

import numpy as np
from jaxtyping import Int

PERIOD_NS = 1_000_000
"""The loop of exograv: 1 kHz."""

LATE_NS = 500_000
"""Half a period: a torque that is later belongs to another posture [ns]."""

EDGES_US = (0, 5, 10, 20, 50, 100, 200, 500, 1_000, 2_000, 5_000, 10_000, 100_000, 10_000_000)
"""Bins of lateness [µs]; 200 and 1000 are the limits of the self-test. What is later still counts in the last."""

Ticks = Int[np.ndarray, " tick"]


@dataclass(frozen=True)
class Percentiles:
    """Percentiles of a time [µs]."""

    p50: float
    p99: float
    p999: float
    max: float


def percentiles_us(ns: Ticks) -> Percentiles:
    """Percentiles of times in nanoseconds, to a tenth of a microsecond."""
    return Percentiles(*(round(1e-3 * float(value), 1) for value in (*np.percentile(ns, [50, 99, 99.9]), ns.max())))


class LoopOutcome(enum.Enum):
    """How a loop ended; the value is a sentence for the operator."""

    COMPLETE = "The loop ran its full time."
    NO_REST = "The loop was broken off: the tick left no time to sleep, and would have taken the processor for itself."


@dataclass(frozen=True)
class Timing:
    """One entry per tick that ran; a period whose time passed without a tick has none."""

    period: Ticks
    """Which period the tick belongs to, counted from 0."""

    lateness_ns: Ticks
    """From the period's start to the tick's [ns]."""

    compute_ns: Ticks
    """From the tick's start to its command [ns]."""

    periods: int
    """Periods that passed, with a tick or without."""

    period_ns: int
    """Length of a period [ns]."""

    outcome: LoopOutcome

    @property
    def command_ns(self) -> Ticks:
        """From the period's start to the command: lateness and computing together [ns]."""
        return self.lateness_ns + self.compute_ns

    @property
    def seconds(self) -> float:
        """Time that passed [s]."""
        return 1e-9 * self.periods * self.period_ns

    @property
    def effective_rate_Hz(self) -> float:
        """Commands a second."""
        return len(self.period) / self.seconds

    @property
    def missed(self) -> int:
        """Periods that ended without their own command."""
        return self.periods - int(np.count_nonzero(self.command_ns <= self.period_ns))

    @property
    def late_share(self) -> float:
        """Share of commands that came more than `LATE_NS` after their period's start."""
        return float(np.mean(self.command_ns > LATE_NS))

    @property
    def longest_gap_us(self) -> float:
        """Longest time between a command and the next [µs]; a period where there are no two."""
        commands = self.period * self.period_ns + self.command_ns
        return 1e-3 * float(np.diff(commands).max(initial=self.period_ns))

    def woken_within(self, limit_ns: int) -> float:
        """Share of all periods whose tick started at most `limit_ns` after the period [ns]."""
        return float(np.count_nonzero(self.lateness_ns <= limit_ns)) / self.periods

    def histogram(self) -> list[int]:
        """Ticks by lateness, one count per pair of `EDGES_US`."""
        lateness_us = np.clip(1e-3 * self.lateness_ns, 0.0, EDGES_US[-1])
        return np.histogram(lateness_us, EDGES_US)[0].tolist()
