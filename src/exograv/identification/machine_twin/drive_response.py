"""Response of the drives: measured current as the commanded one, late, through a lag, with noise.

    current(t) = scale · lag(current_asked(t − delay)) + offset + noise

The command is constant between two ticks. The lag is of first or second order, as the recordings tell. Delay and
bandwidth are those of command and measurement together.

A log of another program with rows more than `SURE_PERIOD_S` apart may lack commands between its rows. A command of a
faster loop is held for a shorter time than the period P between rows, and the fitted delay is too short by up to P/2.
The delay is then uncertain by half a period, and the order of the lag is not told.
"""

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float
from scipy.linalg import expm
from scipy.optimize import least_squares
from scipy.signal import lfilter

from .measured_motion import MeasuredMotion

DELAY_MAX_S = 0.02
"""Largest delay that is searched [s]."""

BANDWIDTH_RANGE_HZ = (2.0, 400.0)
"""Range of the bandwidths that are searched; a faster motor cannot be told from one without lag at 1 kHz [Hz]."""

DELAYS_SEARCHED = 8
"""Number of delays of the coarse search, one tick apart."""

DAMPING_RANGE = (0.2, 3.0)
"""Range of the damping ratios of a lag of second order [-]."""

SURE_OF_SECOND = 30.0
"""Least gain of twice the log-likelihood by a lag of second order for its use [-]."""

SURE_PERIOD_S = 0.0011
"""Longest time between two rows of another program's log that is taken for its loop's period [s]."""

BANDWIDTHS_SEARCHED_HZ = (12.0, 40.0, 120.0)
"""Bandwidths of the coarse search [Hz]."""

Joints = Float[np.ndarray, " joint"]


@dataclass(frozen=True)
class DriveResponse:
    """Response of the drives of a machine; NaN where the recordings do not tell it."""

    delay_s: float
    """Delay of command and measurement together, the same for all drives [s]."""

    delay_sd_s: float
    delay_spread: float
    """Disagreement of the joints' delays: root of the mean squared deviation over their standard deviations [-]."""

    bandwidth_Hz: Joints
    bandwidth_sd_log: Joints
    """Standard deviation of the natural logarithm of the bandwidth [-]."""

    damping: Joints
    """Damping ratio of drives whose lag is of second order; NaN for a first order [-]."""

    noise_A: Joints
    """Standard deviation of the current's noise per tick [A]."""

    first_order_delay_s: float
    """Mean delay if each lag is replaced by the nearest one of first order [s]."""

    first_order_Hz: Joints
    """Bandwidths of these lags [Hz]."""


@dataclass(frozen=True)
class _OfJoint:
    """Delay [s], logarithm of the bandwidth [Hz] and of the damping [-] of one drive, with covariance, and noise [A].

    A lag of first order has no damping.
    """

    x: Float[np.ndarray, " unknown"]
    covariance: Float[np.ndarray, "unknown unknown"]
    noise: float
    first_order: Float[np.ndarray, " some"]
    """Delay, bandwidth, and damping that has no effect, of the lag of first order that comes nearest."""


@dataclass(frozen=True)
class _BothOrders:
    """Response of one drive by a lag of first and of second order."""

    first: _OfJoint
    second: _OfJoint
    gained: float
    """Twice the gain of the log-likelihood by the second order [-]."""


def drive_response(motions: tuple[MeasuredMotion, ...]) -> DriveResponse:
    """Fit the response of all drives to the recordings that hold their commands."""
    unsure_s = max((m.period_s for m in motions if not m.has_all_commands and m.period_s > SURE_PERIOD_S), default=0.0)
    found = _of_one_order([_of_joint(motions, joint) for joint in range(motions[0].q.shape[1])], unsure_s > 0.0)
    known = [one for one in found if one is not None]
    delay_s, delay_sd_s, spread = _common_delay(known) if known else (np.nan, np.nan, np.nan)
    delay_sd_s = float(np.hypot(delay_sd_s, 0.5 * unsure_s / np.sqrt(3.0)))
    bandwidth, sd, damping, noise, simple = (np.full(len(found), np.nan) for _ in range(5))
    for joint, one in enumerate(found):
        if one is None:
            continue
        slope = one.covariance[1, 0] / one.covariance[0, 0]
        bandwidth[joint] = np.exp(one.x[1] + slope * (delay_s - one.x[0]))
        alone = one.covariance[1, 1] - slope * one.covariance[0, 1]
        sd[joint], noise[joint] = np.sqrt(alone + (slope * delay_sd_s) ** 2), one.noise
        simple[joint] = np.exp(one.first_order[1])
        if len(one.x) > 2:
            damping[joint] = np.exp(one.x[2])
    simple_delay = float(np.mean([one.first_order[0] for one in known])) if known else np.nan
    return DriveResponse(delay_s, delay_sd_s, spread, bandwidth, sd, damping, noise, simple_delay, simple)


def _common_delay(known: list[_OfJoint]) -> tuple[float, float, float]:
    """Return mean delay of the joints, its standard deviation, and the disagreement of the joints."""
    delays, weights = np.array([one.x[0] for one in known]), np.array([1.0 / one.covariance[0, 0] for one in known])
    mean = float(weights @ delays / weights.sum())
    freedoms = len(known) - 1
    spread = float(np.sqrt(weights @ (delays - mean) ** 2 / freedoms)) if freedoms else 1.0
    return mean, float(max(spread, 1.0) / np.sqrt(weights.sum())), spread


def _of_joint(motions: tuple[MeasuredMotion, ...], joint: int) -> "_BothOrders | None":
    """Fit the response of one drive; None if no recording holds its changing command."""
    used = [m for m in motions if np.isfinite(m.current_asked[:, joint]).all() and np.ptp(m.current_asked[:, joint])]
    if not used:
        return None
    first, second = (_fitted_lag(used, joint, order) for order in (1, 2))
    ticks = sum(len(m.t) for m in used)
    gained = 2.0 * ticks * np.log(first.noise / second.noise)
    return _BothOrders(first, replace(second, first_order=first.x), gained)


def _of_one_order(found: list["_BothOrders | None"], is_simple: bool) -> list[_OfJoint | None]:
    """Choose the same order for all drives: they are of one make, and a joint that moves little tells it badly."""
    is_second = not is_simple and sum(one.gained for one in found if one is not None) > SURE_OF_SECOND
    return [None if one is None else one.second if is_second else one.first for one in found]


def _fitted_lag(used: list[MeasuredMotion], joint: int, order: int) -> _OfJoint:
    """Fit delay, bandwidth and, for a lag of second order, damping."""

    def residual(x: np.ndarray) -> np.ndarray:
        return np.concatenate([_left(m.current_asked[:, joint], m.current[:, joint], x, m.period_s) for m in used])

    # The cost has a kink at each whole tick of delay, and local minima: the best of a coarse grid is the start.
    delays, damping = (np.arange(DELAYS_SEARCHED) + 0.5) * used[0].period_s, [0.0] * (order - 1)
    starts = [np.array([delay, np.log(f), *damping]) for delay in delays for f in BANDWIDTHS_SEARCHED_HZ]
    costs = [float(np.square(residual(start)).sum()) for start in starts]
    low = np.array([0.0, np.log(BANDWIDTH_RANGE_HZ[0]), np.log(DAMPING_RANGE[0])][: order + 1])
    high = np.array([DELAY_MAX_S, np.log(BANDWIDTH_RANGE_HZ[1]), np.log(DAMPING_RANGE[1])][: order + 1])
    scale, start = [1e-4, 0.1, 0.1][: order + 1], starts[int(np.argmin(costs))]
    best = least_squares(residual, start, bounds=(low, high), x_scale=scale, diff_step=1e-3)
    noise = float(np.sqrt(np.mean(best.fun**2)))
    return _OfJoint(best.x, noise**2 * np.linalg.pinv(best.jac.T @ best.jac), noise, best.x)


def _left(
    asked: Float[np.ndarray, " tick"], measured: Float[np.ndarray, " tick"], x: Float[np.ndarray, " unknown"], dt: float
) -> Float[np.ndarray, " tick"]:
    """Measured current minus the response to the commanded one, scaled and shifted to fit best [A]."""
    damping = float(np.exp(x[2])) if len(x) > 2 else None
    expected = response(asked, float(x[0]), float(np.exp(x[1])), dt, damping)
    design = np.column_stack([expected, np.ones(len(expected))])
    best, *_ = np.linalg.lstsq(design, measured, rcond=None)
    return measured - design @ best


def response(
    asked: Float[np.ndarray, " tick"],
    delay_s: float,
    bandwidth_Hz: float,
    period_s: float,
    damping: float | None = None,
) -> Float[np.ndarray, " tick"]:
    """Response to a command that is held from tick to tick, by a lag behind a delay of any length.

    The lag is of first order without `damping`, and of second order with this damping ratio [-].
    """
    whole, part = divmod(delay_s / period_s, 1.0)
    rate = 2.0 * np.pi * bandwidth_Hz
    if damping is None:
        A, B = np.array([[-rate]]), np.array([[rate]])
    else:
        A, B = np.array([[0.0, 1.0], [-(rate**2), -2.0 * damping * rate]]), np.array([[0.0], [rate**2]])
    # During one period the older command acts for the share `part`, then the newer one.
    until, driven = _held(A, B, (1.0 - part) * period_s)
    _, by_older = _held(A, B, part * period_s)
    decay = _held(A, B, period_s)[0]
    first, moved = float(asked[0]), asked - asked[0]
    newer, older = (_late(moved, int(whole) + ticks) for ticks in (0, 1))
    numerators = [_numerator(decay, one) for one in (driven, until @ by_older)]
    denominator = np.poly(decay)
    parts = [np.asarray(lfilter(b, denominator, one)) for b, one in zip(numerators, (newer, older), strict=True)]
    return first + parts[0] + parts[1]


def _held(
    A: Float[np.ndarray, "state state"], B: Float[np.ndarray, "state 1"], seconds: float
) -> tuple[Float[np.ndarray, "state state"], Float[np.ndarray, " state"]]:
    """Return the transition of the state in some time, and the effect of a constant command of 1 on it."""
    n = len(A)
    whole = np.zeros((n + 1, n + 1))
    whole[:n, :n], whole[:n, n:] = A, B
    moved = expm(whole * seconds)
    return moved[:n, :n], moved[:n, n]


def _numerator(
    decay: Float[np.ndarray, "state state"], driven: Float[np.ndarray, " state"]
) -> Float[np.ndarray, " power"]:
    """Numerator of the discrete filter from a command to the first state, in rising powers of the delay."""
    if len(decay) == 1:
        return np.array([0.0, driven[0]])
    return np.array([0.0, driven[0], decay[0, 1] * driven[1] - decay[1, 1] * driven[0]])


def _late(values: Float[np.ndarray, " tick"], ticks: int) -> Float[np.ndarray, " tick"]:
    return np.concatenate([np.full(ticks, values[0]), values])[: len(values)]


EQUAL_RAD = 2e-8
"""Largest difference of two positions that are the same before their rounding to the digits of a text [rad]."""


def encoder_step(q: Float[np.ndarray, " tick"]) -> float:
    """Quantisation step of an encoder [rad]: the smallest difference between two positions that occur.

    An encoder without visible steps, with noise, gets the step whose rounding has the same standard deviation.
    """
    values = np.unique(q)
    if len(values) < 3:
        return 0.0
    steps = np.diff(values)
    steps = steps[steps > EQUAL_RAD]
    least = float(steps.min())
    if np.mean(np.abs(steps / least - np.round(steps / least)) < 0.05) > 0.95:
        return least
    third = np.diff(q, 3)
    # Motion changes little in three ticks, and a part of the rest is noise that repeats the value before.
    return float(np.sqrt(12.0) * np.std(third[np.abs(third) < 5.0 * np.std(third)]) / np.sqrt(20.0))
