"""Change of log deviation over windows and sessions, after rests, and at the first touch."""

import itertools
import warnings
from dataclasses import dataclass

import numpy as np
import pandas as pd
from jaxtyping import Float
from scipy import optimize, stats

from exograv.study.statistics.people import FLOOR

from .selecting import column, middle

LONG_REST = 1.5
"""Ratio to the usual rest of a session above which a rest is long."""

MIN_SLOPE = 3
"""Least number of points for a slope."""

MIN_FIT = 6
"""Least number of points for the fit of an exponential with three parameters."""


@dataclass(frozen=True)
class IntervalEstimate:
    """Value with its 95 % interval; NaN if it cannot be computed."""

    value: float = np.nan
    low: float = np.nan
    high: float = np.nan


def log_deviation(touches: pd.DataFrame) -> Float[np.ndarray, " touch"]:
    """Natural logarithm of deviations [px]."""
    return np.log(np.maximum(column(touches, "deviation_px").to_numpy(float), FLOOR["px"]))


def theil_sen(x: Float[np.ndarray, " point"], y: Float[np.ndarray, " point"]) -> IntervalEstimate:
    """Median of the slopes through all pairs of points, with Sen's interval; outliers have little effect.

    Source: Sen 1968, J Am Stat Assoc 63:1379.
    """
    if len(np.unique(x)) < MIN_SLOPE:
        return IntervalEstimate()
    slope, _, low, high = np.array(stats.theilslopes(y, x), float).tolist()
    return IntervalEstimate(slope, low, high)


def exponential(x: Float[np.ndarray, " point"], y: Float[np.ndarray, " point"]) -> dict[str, IntervalEstimate]:
    """Fit `start`, `scale`, `plateau` of y = plateau + start·exp(−(x − x₀)/scale) by least squares.

    x₀ is the smallest x. Intervals are those of the linearised fit. All values are NaN in these cases:

    - There are too few points, or the fit does not converge.
    - The scale is longer than the observed range: the plateau was not reached.
    - The interval of `start` holds 0: without a change there is no time constant.
    """
    nothing: dict[str, IntervalEstimate] = dict.fromkeys(("start", "scale", "plateau"), IntervalEstimate())
    if len(x) < MIN_FIT:
        return nothing
    since = x - x.min()
    guess = (y[0] - y[-1], max(since.max() / 3.0, 0.1), y[-1])
    law = lambda s, start, scale, plateau: plateau + start * np.exp(-s / scale)  # noqa: E731
    bounds = ([-np.inf, 0.05, -np.inf], [np.inf, 10.0 * since.max(), np.inf])
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", optimize.OptimizeWarning)  # The covariance is then infinite.
            values, covariance = optimize.curve_fit(law, since, y, guess, bounds=bounds)
    except RuntimeError:  # no convergence
        return nothing
    spread = np.sqrt(np.diag(covariance)) * stats.t.ppf(0.975, len(x) - 3)
    if values[1] > since.max() or not np.isfinite(spread).all() or abs(values[0]) <= spread[0]:
        return nothing
    return {
        name: IntervalEstimate(float(v), float(v - s), float(v + s))
        for name, v, s in zip(nothing, values, spread, strict=True)
    }


def session_learning(touches: pd.DataFrame) -> dict[str, IntervalEstimate]:
    """Compute the learning measures of one session from its accepted touches, in order of time."""
    windows = [group for _, group in touches.groupby("window", sort=True)]
    medians = np.array([np.median(log_deviation(w)) for w in windows])
    numbers = np.array([float(w["window"].iloc[0]) for w in windows])
    slope = theil_sen(numbers, medians)
    values = {"first_touch_cost": _first_touch_cost(windows), **_costs_of_rest(windows)}
    if len(windows) and numbers[0] == 1.0:
        first = windows[0]
        values |= {f"first_window_deviation_{unit}": middle(first, f"deviation_{unit}") for unit in ("px", "mm")}
        if len(windows) > 1:
            values["first_window_cost"] = float(medians[0] - np.median(medians[1:]))
    return {"slope_in_session": slope, **{name: IntervalEstimate(value) for name, value in values.items()}}


def _first_touch_cost(windows: list[pd.DataFrame]) -> float:
    logs = [log_deviation(w) for w in windows if len(w) > 1]
    return float(np.mean([log[0] - log[1:].mean() for log in logs])) if logs else np.nan


def _costs_of_rest(windows: list[pd.DataFrame]) -> dict[str, float]:
    """Compute the mean rise of log deviation over a rest, and over a long rest.

    The rise is from the last half of the window before the rest to the first half of the next window. Both windows
    have at least two touches.
    """
    rests, costs = [], []
    for before, after in itertools.pairwise(windows):
        follows = after["window"].iloc[0] - before["window"].iloc[0] == 1
        if follows and min(len(before), len(after)) > 1:
            late = log_deviation(before)[len(before) // 2 :]
            early = log_deviation(after)[: len(after) // 2]
            rests.append(float(after["opened_s"].iloc[0] - before["closed_s"].iloc[0]))
            costs.append(float(early.mean() - late.mean()))
    if not costs:
        return {}
    is_long = np.array(rests) >= LONG_REST * np.median(rests)
    of_long = {"cost_of_long_rest": float(np.mean(np.array(costs)[is_long]))} if is_long.any() else {}
    return {"cost_of_rest": float(np.mean(costs)), **of_long}


def participant_learning(
    sessions: Float[np.ndarray, " session"], median_px: Float[np.ndarray, " session"]
) -> dict[str, IntervalEstimate]:
    """Compute a person's learning over sessions of one protocol, from their numbers and median deviations [px]."""
    log = np.log(np.maximum(median_px, FLOOR["px"]))
    fit = exponential(sessions, log)
    plateau = fit["plateau"]
    return {
        "slope_across_sessions": theil_sen(sessions, log),
        "change_start": fit["start"],
        "change_sessions": fit["scale"],
        "plateau_px": IntervalEstimate(*(float(np.exp(v)) for v in (plateau.value, plateau.low, plateau.high))),
    }
