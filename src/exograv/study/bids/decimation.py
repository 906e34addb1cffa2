"""Decimation of ticks without aliasing and without delay. No value is carried across a gap.

Each stretch without a missing tick is filtered separately, by a symmetric FIR filter, so that there is no delay. The
stretch is continued beyond its ends by point reflection. A row whose own tick is missing has no values.
"""

from collections.abc import Iterator
from dataclasses import dataclass, field
from itertools import pairwise

import numpy as np
from jaxtyping import Float, Integer
from scipy import signal

HALF_STEPS = 8
"""Half of the filter's length [rows]."""

CUTOFF = 0.8
"""Frequency at which the filter passes half (-6 dB), as a share of half the new rate.

Below 0.6 of half the new rate, the gain error is at most 0.7 %. Frequencies that could fold back into this band are
damped to less than 0.7 %.
"""

LATE_PERIODS = 2.5
"""Longest interval between two consecutive ticks [periods]. After a longer one, ticks are missing, whatever the numbers
say.
"""

FILL_MAX_S = 3600.0
"""Longest gap that is filled with empty rows [s]. A longer gap is a jump of the clock."""


@dataclass(frozen=True)
class RowBlock:
    """Consecutive rows without a gap."""

    t: Float[np.ndarray, " row"]
    """Time of the row's tick [s]; interpolated between its neighbours if the tick is missing."""

    filtered: Float[np.ndarray, "row filtered"]
    plain: Float[np.ndarray, "row plain"]
    """Values of the row's own tick, unfiltered."""


@dataclass
class DecimationReport:
    """Counts of ticks, rows and gaps during the decimation."""

    ticks: int = 0
    rows: int = 0
    missing: int = 0
    """Number of rows whose tick is missing."""

    dropped: int = 0
    """Number of dropped ticks, which are not later than a tick before them."""

    gaps: list[tuple[float, float]] = field(default_factory=list)
    """Last tick before each gap and first tick after it [s]."""

    steady: int = 0
    """Number of steps from one tick to the next without a gap."""

    steady_s: float = 0.0
    """Total time of these steps [s]."""


def taps_of(step: int) -> Float[np.ndarray, " tap"]:
    """Coefficients of the filter for every `step`-th tick: a low pass with a Hamming window and unit sum."""
    if step == 1:
        return np.ones(1)
    return np.asarray(signal.firwin(2 * HALF_STEPS * step + 1, CUTOFF / step, window="hamming"))


class Decimation:
    """Decimator that takes ticks piece by piece and yields rows as soon as enough following ticks are known."""

    def __init__(self, step: int, rate_Hz: float):
        """Start without ticks.

        Args:
            step: Ticks per row.
            rate_Hz: Nominal rate of the ticks.
        """
        self._step, self._rate, self._taps = step, rate_Hz, taps_of(step)
        self._half = len(self._taps) // 2
        self.account = DecimationReport()
        self._stretch = np.empty((0, 0))
        self._n_filtered = 0
        self._first = 0  # number of the first tick held, by the nominal rate from the first of all
        self._begun = 0  # number of the first tick of the stretch
        self._count = 0  # its ticks so far
        self._next_row = 0
        self._last: tuple[float, int, int] | None = None  # time, number, sequence of the last tick

    def feed(
        self,
        t: Float[np.ndarray, " tick"],
        sequence: Integer[np.ndarray, " tick"],
        filtered: Float[np.ndarray, "tick filtered"],
        plain: Float[np.ndarray, "tick plain"],
    ) -> Iterator[RowBlock]:
        """Take further ticks.

        Args:
            t: Time of measurement of each tick [s].
            sequence: Number of each tick; 0 without a number.
            filtered: Values that are filtered.
            plain: Values that are not filtered, such as states.
        """
        self._n_filtered = filtered.shape[1]
        before = self._last[0] if self._last else -np.inf
        is_later = t > np.maximum.accumulate(np.concatenate([[before], t[:-1]])) if len(t) else np.zeros(0, bool)
        self.account.dropped += int(np.count_nonzero(~is_later))
        t, sequence, values = t[is_later], sequence[is_later], np.column_stack([t, filtered, plain])[is_later]
        if not len(t):
            return
        self.account.ticks += len(t)
        steps, is_gap = self._steps(t, sequence.astype(np.int64))
        bounds = [0, *np.flatnonzero(is_gap).tolist(), len(t)]
        for first, end in pairwise(bounds):
            if first < end:
                if self._last is None or is_gap[first]:
                    yield from self._finish()
                    yield from self._begin(float(t[first]), int(steps[first]), values.shape[1])
                yield from self._go_on(values[first:end])
                number = self._begun + self._count - 1
                self._last = (float(t[end - 1]), number, int(sequence[end - 1]))

    def end(self) -> Iterator[RowBlock]:
        """Yield the remaining rows after the last tick."""
        yield from self._finish()

    def _steps(self, t: np.ndarray, sequence: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Periods since the tick before, and True where ticks are missing in between."""
        last_t, _, last_sequence = self._last or (t[0], 0, 0)
        elapsed, numbers = np.diff(t, prepend=last_t), np.diff(sequence, prepend=last_sequence)
        is_counted = (sequence > 0) & (np.concatenate([[last_sequence], sequence[:-1]]) > 0)
        periods = np.maximum(np.round(elapsed * self._rate), 1).astype(np.int64)
        is_next = np.where(is_counted, (numbers == 1) & (elapsed * self._rate < LATE_PERIODS), periods == 1)
        if self._last is None:
            is_next[0] = True
        self.account.steady += int(np.count_nonzero(is_next)) - (self._last is None)
        self.account.steady_s += float(elapsed[is_next].sum())
        return np.where(is_next, 1, periods), ~is_next

    def _begin(self, t: float, periods: int, columns: int) -> Iterator[RowBlock]:
        """Begin a stretch, and yield empty rows for the missing ticks before it."""
        number = 0
        if self._last is not None:
            last_t, last, _ = self._last
            self.account.gaps.append((last_t, t))
            if t - last_t > FILL_MAX_S:
                number = self._next_row
            else:
                number = last + periods
                rows = np.arange(self._next_row, number, self._step)
                yield from self._empty(last_t + (rows - last) * (t - last_t) / periods, columns)
        self._stretch = np.empty((0, columns))
        self._first = self._begun = number
        self._count = 0

    def _empty(self, t: np.ndarray, columns: int) -> Iterator[RowBlock]:
        if len(t):
            self._next_row += self._step * len(t)
            self.account.missing += len(t)
            yield self._block(t, np.full((len(t), columns - 1), np.nan))

    def _block(self, t: np.ndarray, values: np.ndarray) -> RowBlock:
        self.account.rows += len(t)
        return RowBlock(t, values[:, : self._n_filtered], values[:, self._n_filtered :])

    def _go_on(self, values: np.ndarray) -> Iterator[RowBlock]:
        was_begun = self._count > self._half
        self._stretch = np.concatenate([self._stretch, values])
        self._count += len(values)
        if not was_begun and self._count > self._half:
            self._extend(self._half, 0)
        if self._count > self._half:
            yield from self._rows()

    def _finish(self) -> Iterator[RowBlock]:
        """Yield the rows that needed the end of the stretch."""
        if self._count:
            self._extend(0 if self._count > self._half else self._half, self._half)
            yield from self._rows()
        self._count = 0

    def _extend(self, before: int, after: int) -> None:
        """Extend the stretch by point reflection about its first and last value; a lone tick is repeated."""
        around = ((before, after), (0, 0))
        if len(self._stretch) > 1:
            self._stretch = np.pad(self._stretch, around, mode="reflect", reflect_type="odd")
        else:
            self._stretch = np.pad(self._stretch, around, mode="edge")
        self._first -= before

    def _rows(self) -> Iterator[RowBlock]:
        """Yield the rows that have all ticks of the filter around them, and keep the ticks that later rows need."""
        half, step = self._half, self._step
        count = (self._first + len(self._stretch) - 1 - half - self._next_row) // step + 1
        if count <= 0:
            return
        centre = self._next_row - self._first
        around = self._stretch[centre - half : centre + (count - 1) * step + half + 1]
        own = self._stretch[centre : centre + (count - 1) * step + 1 : step]
        first = 2 * half // step
        filtered = signal.upfirdn(self._taps, around[:, 1 : 1 + self._n_filtered], 1, step, axis=0)
        self._next_row += count * step
        yield self._block(own[:, 0], np.column_stack([filtered[first : first + count], own[:, 1 + self._n_filtered :]]))
        kept = min(max(self._next_row - half - self._first, 0), len(self._stretch))
        self._stretch, self._first = self._stretch[kept:], self._first + kept
