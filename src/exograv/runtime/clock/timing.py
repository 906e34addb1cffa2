"""Measured times of the ticks of a live loop, the basis of every assessment of a computer's timing."""

import enum
from dataclasses import dataclass

import numpy as np
from jaxtyping import Int

PERIOD_NS = 1_000_000
"""Period of exograv's loop, at 1 kHz [ns]."""

LATE_NS = 500_000
"""Delay above which a torque belongs to another posture: half a period [ns]."""

EDGES_US = (0, 5, 10, 20, 50, 100, 200, 500, 1_000, 2_000, 5_000, 10_000, 100_000, 10_000_000)
"""Edges of the lateness bins [µs]; 200 and 1000 are limits of the self-test, and the last bin holds all above."""

Ticks = Int[np.ndarray, " tick"]


@dataclass(frozen=True)
class Percentiles:
    """Percentiles of a time [µs]."""

    p50: float
    p99: float
    p999: float
    max: float


def percentiles_us(ns: Ticks) -> Percentiles:
    """Percentiles of times in nanoseconds, rounded to a tenth of a microsecond."""
    return Percentiles(*(round(1e-3 * float(value), 1) for value in (*np.percentile(ns, [50, 99, 99.9]), ns.max())))


class LoopOutcome(enum.Enum):
    """End of a loop; the value is a sentence for the operator."""

    COMPLETE = "The loop ran its full time."
    ENDED_EARLY = "The loop ended before its full time."
    NO_REST = "The loop was stopped: the ticks left no time to sleep, and would have blocked the processor."


@dataclass(frozen=True)
class Timing:
    """Timing of a loop, one entry per tick that ran; a period without a tick has none."""

    period: Ticks
    """Period of the tick, counted from 0."""

    lateness_ns: Ticks
    """Time from the start of the period to the start of the tick [ns]."""

    compute_ns: Ticks
    """Time from the start of the tick to its command [ns]."""

    periods: int
    """Number of periods that passed, with a tick or without."""

    period_ns: int
    """Length of a period [ns]."""

    outcome: LoopOutcome

    waited_ns: int | None = None
    """Time for which a machine waited for the loop beyond its periods [ns]; None for a machine that never waits."""

    @property
    def command_ns(self) -> Ticks:
        """Time from the start of the period to the command: lateness and computation [ns]."""
        return self.lateness_ns + self.compute_ns

    @property
    def seconds(self) -> float:
        """Duration of the loop [s]."""
        return 1e-9 * self.periods * self.period_ns

    @property
    def effective_rate_Hz(self) -> float:
        """Commands per second, over the whole loop."""
        return len(self.period) / self.seconds

    @property
    def missed(self) -> int:
        """Number of periods that ended without their own command."""
        return self.periods - int(np.count_nonzero(self.command_ns <= self.period_ns))

    @property
    def late_share(self) -> float:
        """Share of commands that came more than `LATE_NS` after the start of their period."""
        return float(np.mean(self.command_ns > LATE_NS))

    @property
    def longest_gap_us(self) -> float:
        """Longest time between two commands [µs]; one period if there are fewer than two."""
        commands = self.period * self.period_ns + self.command_ns
        return 1e-3 * float(np.diff(commands).max(initial=self.period_ns))

    def woken_within(self, limit_ns: int) -> float:
        """Share of all periods whose tick started at most `limit_ns` after the period [ns]."""
        return float(np.count_nonzero(self.lateness_ns <= limit_ns)) / self.periods

    def histogram(self) -> list[int]:
        """Return the number of ticks by lateness, one count per pair of `EDGES_US`."""
        lateness_us = np.clip(1e-3 * self.lateness_ns, 0.0, EDGES_US[-1])
        return np.histogram(lateness_us, EDGES_US)[0].tolist()
