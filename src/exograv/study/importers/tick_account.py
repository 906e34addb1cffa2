"""Count of a recording's ticks, missing ticks, and jumps of a clock, in one pass."""

from collections.abc import Sequence

import numpy as np

LEAP_S = 0.5
"""Largest regular interval between two ticks on the rig's clock; 500 periods of 1 ms, far above any recorder's pause.
"""

APART_S = 0.25
"""Largest accepted difference between the rig's clock and the computer's clock over one tick."""


class TickAccount:
    """Counters of ticks, which take the ticks piece by piece."""

    def __init__(self):
        self.count = self.lost = self._apart = 0
        self.first_t = self.last_t = self.rate_Hz = float("nan")
        self._leaps = list[tuple[float, float]]()
        self._before: np.ndarray | None = None

    def take(self, ticks: np.ndarray) -> None:
        """Count the ticks (tick,) that follow those before."""
        if not len(ticks):
            return
        if self._before is None:
            self.first_t = float(ticks["t"][0])
        self.count += len(ticks)
        together = ticks if self._before is None else np.concatenate([self._before, ticks])
        self._before, self.last_t = ticks[-1:].copy(), float(ticks["t"][-1])
        steps = np.diff(together["t"])
        if np.isnan(self.rate_Hz) and (forward := steps[steps > 0.0]).size:
            self.rate_Hz = round(1.0 / float(np.median(forward)), 1)
        strange = np.flatnonzero(~((steps > 0.0) & (steps <= LEAP_S)))
        self._leaps += [(float(together["t"][k]), float(together["t"][k + 1])) for k in strange]
        self._compare_clocks(together, steps)
        counted = together["sequence"].astype(np.int64)
        missing = np.diff(counted) - 1
        self.lost += int(missing[(counted[:-1] > 0) & (missing > 0)].sum())

    def _compare_clocks(self, ticks: np.ndarray, steps: np.ndarray) -> None:
        apart = np.abs(np.diff(ticks["monotonic"]) - np.diff(ticks["now"]))
        self._apart += int(np.count_nonzero((apart > APART_S) & (steps > 0.0) & (steps <= LEAP_S)))

    def jumps(self, said: Sequence[tuple[float, str]]) -> int:
        """Count the times that a clock went back or jumped ahead, without the jump of a run that was resumed.

        Args:
            said: Times [s] and kinds of the task's records; the first record after a resumed run's jump is `paused`.
        """
        unexplained = [(a, b) for a, b in self._leaps if b < a or _first_after(a, said) != "paused"]
        return len(unexplained) + self._apart


def _first_after(t: float, said: Sequence[tuple[float, str]]) -> str | None:
    return min(((at, kind) for at, kind in said if at > t), default=(t, None))[1]
