"""Computing times of the ticks, and share of limited torques: figures about all ticks, in constant memory."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int, Shaped

FIELDS = ("tick_us", "tau_commanded", "tau_desired")
"""Fields of the ticks that `computing_times` needs."""

BLOCK = 200_000
"""Ticks whose times are sorted and counted together."""


@dataclass(frozen=True)
class ComputingTimes:
    """Computing times of all ticks: each value once, and how often it occurs.

    Times are whole nanoseconds, so that an hour at 1 kHz has some ten thousand values.
    """

    values_us: Float[np.ndarray, " value"]
    """Times in rising order, as they are stored; only finite positive ones [µs]."""

    counts: Int[np.ndarray, " value"]
    limited_share: Float[np.ndarray, " joint"]
    """Share of ticks in which the envelope changed the torque [-]; NaN without ticks."""

    def __len__(self) -> int:
        """Return the number of measured ticks."""
        return int(self.counts.sum())

    def percentiles(self, which: Sequence[float]) -> list[float]:
        """Return the percentiles of all times, with the same values as `np.percentile` [µs]."""
        places = np.asarray(which, float) / 100.0 * (len(self) - 1)
        below = np.floor(places)
        last = np.cumsum(self.counts) - 1
        low, high = (
            self.values_us[np.searchsorted(last, np.minimum(rank, len(self) - 1))] for rank in (below, below + 1)
        )
        share, step = places - below, high - low
        # As NumPy does it: from the nearer end, so that the result at both ends is exact.
        return np.where(share < 0.5, low + step * share, high - step * (1.0 - share)).tolist()


def computing_times(pieces: Iterable[np.ndarray], n_joints: int) -> ComputingTimes:
    """Count the times of ticks that come in pieces with `FIELDS`."""
    found: tuple[np.ndarray, np.ndarray] = (np.empty(0, np.float32), np.empty(0, np.int64))
    waiting, limited, ticks = list[np.ndarray](), np.zeros(n_joints), 0
    for piece in pieces:
        limited += (piece["tau_commanded"] != piece["tau_desired"]).sum(axis=0)
        ticks += len(piece)
        waiting.append(_measured(piece["tick_us"]))
        if sum(map(len, waiting)) > BLOCK:
            found, waiting = _merged(found, waiting), []
    values, counts = _merged(found, waiting)
    return ComputingTimes(values, counts, limited / ticks if ticks else np.full(n_joints, np.nan))


def _measured(tick_us: Shaped[np.ndarray, " tick"]) -> np.ndarray:
    return tick_us[np.isfinite(tick_us) & (tick_us > 0.0)]


def _merged(found: tuple[np.ndarray, np.ndarray], waiting: Sequence[np.ndarray]) -> tuple[np.ndarray, np.ndarray]:
    new, counts = np.unique(np.concatenate([*waiting, np.empty(0, np.float32)]), return_counts=True)
    values, places = np.unique(np.concatenate([found[0], new]), return_inverse=True)
    return values, np.bincount(places, np.concatenate([found[1], counts]), len(values)).astype(np.int64)
