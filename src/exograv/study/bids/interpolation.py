"""Values of a band-limited signal between its samples, by a sinc with a Kaiser window."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int
from scipy import sparse

from exograv.study.even_times import Stretch

HALF_TAPS = 16
"""Samples on each side of a value."""

BETA = 7.0
"""Shape of the Kaiser window. Up to 0.8 of half the rate the error is at most 0.1 % of the amplitude (tests)."""

PHASES = 2048
"""Positions between two samples in the table of weights. Between them the weights are interpolated."""

FLAT_TO = 0.8
"""Highest frequency at which the values are true to 0.1 %, as a share of half the rate."""


def _weights_of(share: Float[np.ndarray, " row"]) -> Float[np.ndarray, "row tap"]:
    """Weights of the samples around a value that lies `share` of a period after a sample; their sum is 1."""
    away = np.arange(1 - HALF_TAPS, HALF_TAPS + 1) - share[:, None]
    window = np.i0(BETA * np.sqrt(np.maximum(1.0 - (away / HALF_TAPS) ** 2, 0.0)))
    weights = np.sinc(away) * window
    return weights / weights.sum(1, keepdims=True)


TABLE = _weights_of(np.arange(PHASES + 1) / PHASES)

OVERSHOOT = float(np.abs(TABLE).sum(1).max())
"""Largest ratio of a value to the largest sample around it."""


@dataclass(frozen=True)
class StretchSignal:
    """Samples of one stretch, from which values in between are computed."""

    values: np.ndarray
    """All samples of the stream (sample, channel), which may be in a file."""

    stretch: Stretch

    def at(self, position: Float[np.ndarray, " row"]) -> Float[np.ndarray, "row channel"]:
        """Return band-limited values at increasing positions in the stretch."""
        base = np.floor(position).astype(int)
        share = PHASES * (position - base)
        phase = np.minimum(share.astype(int), PHASES - 1)
        share = (share - phase)[:, None]
        weights = (1.0 - share) * TABLE[phase] + share * TABLE[phase + 1]
        low, high = int(base[0]) + 1 - HALF_TAPS, int(base[-1]) + 1 + HALF_TAPS
        columns = (base - base[0])[:, None] + np.arange(2 * HALF_TAPS)
        starts = np.arange(len(base) + 1) * (2 * HALF_TAPS)
        matrix = sparse.csr_matrix((weights.ravel(), columns.ravel(), starts), (len(base), high - low))
        return matrix @ self._continued(low, high)

    def nearest(self, position: Float[np.ndarray, " row"]) -> Float[np.ndarray, "row channel"]:
        """Return the nearest sample at each position, for values that do not change smoothly."""
        return self._rows(np.round(position).astype(int))

    def _rows(self, index: Int[np.ndarray, " row"]) -> Float[np.ndarray, "row channel"]:
        return self.values[self.stretch.first + index].astype(float)

    def _continued(self, low: int, high: int) -> Float[np.ndarray, "row channel"]:
        """Return samples `low` to `high`; beyond the ends of the stretch they are continued by point reflection."""
        index, last = np.arange(low, high), len(self.stretch.t) - 1
        if last < HALF_TAPS:
            return self._rows(np.clip(index, 0, last))
        rows = self._rows(last - np.abs(last - np.abs(index)))
        is_before, is_after = index < 0, index > last
        rows[is_before] = 2.0 * self._rows(np.array([0])) - rows[is_before]
        rows[is_after] = 2.0 * self._rows(np.array([last])) - rows[is_after]
        return rows
