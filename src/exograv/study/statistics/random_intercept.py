"""REML for touches within people within groups, for many studies at once.

    log deviation = mean of the group + person + touch,   person ~ N(0, person_sd²),   touch ~ N(0, touch_sd²)

Number, mean and sum of squares of a person's touches are sufficient statistics, so a thousand studies take a second.
For
models with more terms see `mixed.py`.
"""

from dataclasses import dataclass

import numpy as np
import pandas as pd
from jaxtyping import Float

LOG_RATIO_MIN, LOG_RATIO_MAX = -12.0, 8.0
"""Range of the logarithm of person variance over touch variance. At the lower end the ratio is taken as 0."""

STEPS = 60
"""Number of steps of the search. Each keeps 0.62 of the bracket, all of them 3e-13."""

GOLDEN = (np.sqrt(5.0) - 1.0) / 2.0


@dataclass(frozen=True)
class SufficientStatistics:
    """Sufficient statistics of each person, for studies with the same number of people."""

    touches: Float[np.ndarray, "study person"]
    mean: Float[np.ndarray, "study person"]
    squares: Float[np.ndarray, " study"]
    """Sum of squared distances from each person's own mean, over all touches."""

    n_first: int
    """Number of people in the first group; they come first."""


def sums_of(counted: pd.DataFrame, groups: tuple[str, str]) -> SufficientStatistics:
    """Compute the statistics of one study, from the columns of `people.counted_touches`."""
    means, sizes, squares, n_first = [], [], 0.0, 0
    for group in groups:
        for _, own in counted.loc[counted["group"] == group].groupby("participant"):
            logs = own["log_deviation"].to_numpy(float)
            means.append(logs.mean())
            sizes.append(float(len(logs)))
            squares += float(((logs - logs.mean()) ** 2).sum())
            n_first += group == groups[0]
    return SufficientStatistics(np.array([sizes]), np.array([means]), np.array([squares]), n_first)


@dataclass(frozen=True)
class Components:
    """Estimates of the mixed model by REML: difference, its error, and variances."""

    difference: Float[np.ndarray, " study"]
    """Difference of the groups, first minus second."""

    error: Float[np.ndarray, " study"]
    """Standard error of the difference for known standard deviations."""

    person_sd: Float[np.ndarray, " study"]
    touch_sd: Float[np.ndarray, " study"]


def fit(sums: SufficientStatistics) -> Components:
    """Maximise the restricted likelihood over the variance ratio by golden section; the rest is in closed form."""
    low = np.full(len(sums.squares), LOG_RATIO_MIN)
    high = np.full(len(sums.squares), LOG_RATIO_MAX)
    for _ in range(STEPS):
        left, right = high - GOLDEN * (high - low), low + GOLDEN * (high - low)
        is_left = _log_likelihood(sums, np.exp(left)) > _log_likelihood(sums, np.exp(right))
        low, high = np.where(is_left, low, left), np.where(is_left, right, high)
    middle = (low + high) / 2.0
    ratio = np.where(middle < LOG_RATIO_MIN + 1e-3, 0.0, np.exp(middle))
    difference, variance_share, touch_variance = _given(sums, ratio)
    touch_sd = np.sqrt(touch_variance)
    return Components(difference, np.sqrt(variance_share) * touch_sd, np.sqrt(ratio) * touch_sd, touch_sd)


def _weights(sums: SufficientStatistics, ratio: Float[np.ndarray, " study"]) -> Float[np.ndarray, "study person"]:
    """Precision of each person's mean, in units of one touch's precision."""
    return sums.touches / (1.0 + ratio[:, None] * sums.touches)


def _groups(sums: SufficientStatistics) -> tuple[slice, slice]:
    return slice(None, sums.n_first), slice(sums.n_first, None)


def _given(
    sums: SufficientStatistics, ratio: Float[np.ndarray, " study"]
) -> tuple[Float[np.ndarray, " study"], Float[np.ndarray, " study"], Float[np.ndarray, " study"]]:
    """Difference, its variance in units of the touch variance, and the touch variance, for this variance ratio."""
    weights = _weights(sums, ratio)
    means, variance, squares = [], np.zeros(len(ratio)), sums.squares.copy()
    for group in _groups(sums):
        total = weights[:, group].sum(1)
        mean = (weights[:, group] * sums.mean[:, group]).sum(1) / total
        squares += (weights[:, group] * (sums.mean[:, group] - mean[:, None]) ** 2).sum(1)
        variance += 1.0 / total
        means.append(mean)
    return means[0] - means[1], variance, squares / (sums.touches.sum(1) - 2.0)


def _log_likelihood(sums: SufficientStatistics, ratio: Float[np.ndarray, " study"]) -> Float[np.ndarray, " study"]:
    """Restricted log likelihood up to a constant."""
    weights = _weights(sums, ratio)
    touch_variance = _given(sums, ratio)[2]
    lost = sum(np.log(weights[:, group].sum(1)) for group in _groups(sums))
    spread = np.log1p(ratio[:, None] * sums.touches).sum(1)
    return -0.5 * ((sums.touches.sum(1) - 2.0) * np.log(touch_variance) + spread + lost)
