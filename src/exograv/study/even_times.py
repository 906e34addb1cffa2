"""Times of a device's samples without the jitter of their stamps, and the even times of an exported file.

A device samples evenly, but many programs stamp a sample when it arrives. So the stamps of each stretch without a lost
sample are replaced by a line with knots, fitted by least squares. It follows the drift of the device.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Int
from scipy import linalg

from exograv.recording.device_stream import DeviceStream, rig_time

KNOT_S = 60.0
"""Distance of knots [s]: long enough to average the jitter, short enough to follow the temperature of an oscillator."""

WINDOW_S = 1.0
"""Time before and after a late stamp whose means tell a lost sample from jitter. A shorter stretch gets no slope of
its own [s].
"""

LATE_PERIODS = 0.5
"""Delay of a stamp, and of the mean of those after it, above which samples may be lost [periods]."""

LATE_DEVIATIONS = 6.0
"""Delay of the mean above which it is not jitter [standard deviations of the mean]."""

PEAK_SHARE = 0.8
"""Share of the largest step of means within `WINDOW_S` above which the step belongs to this loss, not to another."""

ROUNDS = 20
"""Searches for lost samples, at most. Each search finds one loss within `WINDOW_S`."""

NOMINAL_SHARE = 0.01
"""Difference from a whole nominal rate up to which the file has this rate."""

FILL_MAX_S = 3600.0
"""Longest gap that is filled [s]. A longer gap is a jump of the clock."""

Samples = Float[np.ndarray, " sample"]


@dataclass(frozen=True)
class Stretch:
    """Consecutive samples of which none was lost."""

    first: int
    """Index of the first sample among all samples."""

    t: Samples
    """Fitted times [s], which never decrease."""


def period_of(stamps: Samples, rate_Hz: float) -> float:
    """Return the period of a device [s], from samples about a second apart. Gaps and jitter hardly change it."""
    lag = min(round(WINDOW_S * rate_Hz), len(stamps) - 1)
    if lag < 1:
        return 1.0 / rate_Hz
    period = float(np.median(stamps[lag:] - stamps[:-lag])) / lag
    return period if period > 0.0 else 1.0 / rate_Hz


def stretches_of(stamps: Samples, rate_Hz: float) -> list[Stretch]:
    """Return the stretches of one connection with their fitted times, on the clock of the stamps.

    Args:
        stamps: Stamps in the order of arrival [s], at least one.
        rate_Hz: Nominal rate.
    """
    period = period_of(stamps, rate_Hz)
    bounds = np.flatnonzero(_is_loss(stamps, period)) + 1
    parts = np.split(stamps, bounds)
    return [Stretch(int(a), _fitted(part, period)) for a, part in zip([0, *bounds], parts, strict=True)]


def _is_loss(stamps: Samples, period: float) -> Bool[np.ndarray, " step"]:
    """Return True where samples were lost: the stamps after it stay late, while jitter returns."""
    found, half = np.zeros(len(stamps) - 1, bool), max(2, round(WINDOW_S / period))
    away = stamps - period * np.arange(len(stamps))
    if not len(found):
        return found
    # 1.4826 turns the median absolute deviation into the standard deviation of Gaussian noise.
    jitter = 1.4826 / np.sqrt(2.0) * float(np.median(np.abs(np.diff(away))))
    limit = np.maximum(LATE_PERIODS * period, LATE_DEVIATIONS * jitter * _deviation_of_step(len(away), half))
    for _ in range(ROUNDS):
        excess, step = np.diff(away), _step_of_means(away, half)
        is_late = (found | (np.abs(excess) > LATE_PERIODS * period)) & (np.abs(step) > limit)
        lost = np.zeros(len(away))
        # One stamp gives the number of lost samples only to its jitter, so found losses are counted again by means.
        for k in np.flatnonzero(is_late & found):
            if np.abs(step[k]) >= PEAK_SHARE * np.abs(step[max(k - half, 0) : k + half]).max():
                lost[k + 1] = np.round(step[k] / period)
        late = np.flatnonzero(is_late & ~found)
        for k in late[np.argsort(-np.abs(excess[late]), kind="stable")]:
            if not lost[max(k + 1 - half, 0) : k + 1 + half].any():
                found[k], lost[k + 1] = True, np.round(excess[k] / period)
        if not lost.any():
            break
        away -= period * np.cumsum(lost)
    return found


def _step_of_means(values: Samples, half: int) -> Float[np.ndarray, " step"]:
    """Return the mean of the `half` values after each step minus that of the values before it."""
    total = np.concatenate([[0.0], np.cumsum(values - values[0])])
    begin, at, end = _windows(len(values), half)
    return (total[end] - total[at]) / (end - at) - (total[at] - total[begin]) / (at - begin)


def _deviation_of_step(count: int, half: int) -> Float[np.ndarray, " step"]:
    """Return the standard deviation of `_step_of_means` for noise with deviation 1."""
    begin, at, end = _windows(count, half)
    return np.sqrt(1.0 / (end - at) + 1.0 / (at - begin))


def _windows(count: int, half: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return, for each step, the first value before it, the first after it, and the end of those after it."""
    at = np.arange(1, count)
    return np.maximum(at - half, 0), at, np.minimum(at + half, count)


def _fitted(stamps: Samples, period: float) -> Samples:
    """Return the stamps of a stretch without their jitter."""
    index = np.arange(len(stamps), dtype=float)
    if len(stamps) * period < WINDOW_S:
        return np.median(stamps - period * index) + period * index
    return stamps[0] + _line_with_knots(stamps - stamps[0], max(1, round(len(stamps) * period / KNOT_S)))


def _line_with_knots(values: Samples, pieces: int) -> Samples:
    """Fit a continuous line of straight pieces of the same length by least squares. Its normal matrix has 3 bands."""
    at = np.arange(len(values)) * (pieces / (len(values) - 1))
    left = np.minimum(at.astype(int), pieces - 1)
    right_share = at - left
    left_share = 1.0 - right_share

    def summed(weights: Samples) -> Float[np.ndarray, " piece"]:
        return np.bincount(left, weights, pieces)

    bands, right = np.zeros((2, pieces + 1)), np.zeros(pieces + 1)
    bands[0, 1:] = summed(left_share * right_share)
    bands[1, :-1] += summed(left_share**2)
    bands[1, 1:] += summed(right_share**2)
    right[:-1] += summed(left_share * values)
    right[1:] += summed(right_share * values)
    knots = linalg.solveh_banded(bands, right)
    return left_share * knots[left] + right_share * knots[left + 1]


def monotonic_of(stream: DeviceStream, stamps: Samples, connection: Int[np.ndarray, " sample"]) -> Samples:
    """Return stamps on CLOCK_MONOTONIC [s]; NaN for a connection whose clock was never measured."""
    found = np.full(len(stamps), np.nan)
    for number, fit in stream.clocks.items():
        of = connection == number
        found[of] = stamps[of] + fit.correction(stamps[of])
    return found


def placed_stretches(stream: DeviceStream, stamps: Samples, connection: Int[np.ndarray, " sample"]) -> list[Stretch]:
    """Return the stretches of a stream with times on the session's clock, one connection after another.

    Jitter is removed on CLOCK_MONOTONIC: the clock of a simulated machine stands still in a missed period.
    """
    monotonic = monotonic_of(stream, stamps, connection)
    known = np.flatnonzero(np.isfinite(monotonic))
    found = list[Stretch]()
    for number in np.unique(connection[known]):
        own = known[connection[known] == number]
        for one in stretches_of(monotonic[own], stream.nominal_rate_Hz):
            t = np.maximum.accumulate(rig_time(stream.ticks, one.t))
            found.append(Stretch(int(own[one.first]), t))
    return found


@dataclass(frozen=True)
class Run:
    """Rows of an exported file that come from one stretch."""

    first_row: int
    stretch: Stretch
    rows: int


@dataclass(frozen=True)
class EvenTimes:
    """Even times of an exported file, and the stretches from which its rows come."""

    rate_Hz: int
    first_t: float
    """Time of the first row [s]."""

    runs: Sequence[Run]
    """Runs of rows in their order; between two runs, samples are missing."""

    left_out: int
    """Samples that are not later than those before them."""

    @property
    def rows(self) -> int:
        """Rows up to the last sample."""
        return self.runs[-1].first_row + self.runs[-1].rows

    @property
    def gaps(self) -> list[tuple[int, int]]:
        """First row and number of rows of each part without samples."""
        ends = [run.first_row + run.rows for run in self.runs[:-1]]
        begins = [run.first_row for run in self.runs[1:]]
        return [(end, begin - end) for end, begin in zip(ends, begins, strict=True) if begin > end]

    def positions(self, run: Run, first: int, end: int) -> Samples:
        """Return the positions of rows `first` to `end` of a run among the samples of its stretch, not whole."""
        t = self.first_t + np.arange(run.first_row + first, run.first_row + end) / self.rate_Hz
        return np.interp(t, run.stretch.t, np.arange(len(run.stretch.t), dtype=float))


def even_times(stretches: Sequence[Stretch], nominal_Hz: float) -> EvenTimes | None:
    """Place rows evenly over the stretches; None if a gap is longer than `FILL_MAX_S`, which is a jump of the clock.

    The rate is the nominal one, or the next whole number above the device's rate if these two differ.

    Args:
        stretches: Stretches with times on the session's clock, in the order of arrival, at least one.
        nominal_Hz: Nominal rate.
    """
    rate = whole_rate(stretches, nominal_Hz)
    first_t, runs, left_out = float(stretches[0].t[0]), list[Run](), 0
    next_row, last_t = 0, -np.inf
    for stretch in stretches:
        kept = int(np.searchsorted(stretch.t, last_t + 0.5 / rate)) if runs else 0
        left_out += kept
        t = stretch.t[kept:]
        if not len(t):
            continue
        if runs and t[0] - last_t > FILL_MAX_S:
            return None
        begin = max(next_row, int(np.ceil((t[0] - first_t) * rate - 0.5)))
        end = int(np.floor((t[-1] - first_t) * rate + 0.5)) + 1
        last_t = float(t[-1])
        if end > begin:
            runs.append(Run(begin, Stretch(stretch.first + kept, t), end - begin))
            next_row = end
    return EvenTimes(rate, first_t, runs, left_out)


def effective_rate(stretches: Sequence[Stretch]) -> float | None:
    """Return the samples per second of the device on the session's clock, without gaps; None for single samples."""
    steps = sum(len(one.t) - 1 for one in stretches)
    seconds = sum(float(one.t[-1] - one.t[0]) for one in stretches)
    return steps / seconds if seconds > 0.0 else None


def whole_rate(stretches: Sequence[Stretch], nominal_Hz: float) -> int:
    """Return the rate of the file: a whole number, so that a record of one second has whole samples."""
    rate = effective_rate(stretches) or nominal_Hz
    if nominal_Hz == round(nominal_Hz) and abs(rate - nominal_Hz) <= NOMINAL_SHARE * nominal_Hz:
        return round(nominal_Hz)
    return max(1, int(np.ceil(rate)))
