"""Comparison of two groups under normal theory: Welch's interval and test, Hedges' g.

On logarithms these are ratios.
"""

from collections.abc import Callable
from functools import cache
from math import exp, lgamma, sqrt
from typing import cast

import numpy as np
from jaxtyping import Bool, Float
from scipy import optimize, special, stats

from .findings import Effect, Interval, Test
from .wording import p_text

First = Float[np.ndarray, " first"]
Second = Float[np.ndarray, " second"]
T_NODES = 400


def welch_p(
    first: Float[np.ndarray, "study first"], second: Float[np.ndarray, "study second"]
) -> Float[np.ndarray, " study"]:
    """Two-sided p-values of many studies; people without any difference among them give 1 or 0."""
    difference, error, freedom = _welch(first, second)
    with np.errstate(divide="ignore", invalid="ignore"):
        p = 2.0 * stats.t.sf(np.abs(difference) / error, freedom)
    return np.where(error > 0.0, p, np.where(difference == 0.0, 1.0, 0.0))


def welch_width(
    first: Float[np.ndarray, "study first"], second: Float[np.ndarray, "study second"], alpha: float
) -> tuple[Float[np.ndarray, " study"], Bool[np.ndarray, " study"]]:
    """Half width of Welch's interval at level 1 - alpha in many studies, and True where the interval excludes 0."""
    difference, error, freedom = _welch(first, second)
    margin = special.stdtrit(freedom, 1.0 - alpha / 2.0) * error
    return margin, np.abs(difference) > margin


def _welch(
    first: Float[np.ndarray, "study first"], second: Float[np.ndarray, "study second"]
) -> tuple[Float[np.ndarray, " study"], Float[np.ndarray, " study"], Float[np.ndarray, " study"]]:
    """Difference of means, its standard error, degrees of freedom (Welch 1947, Biometrika 34:28)."""
    parts = [group.var(1, ddof=1) / group.shape[1] for group in (first, second)]
    error = np.sqrt(parts[0] + parts[1])
    with np.errstate(divide="ignore", invalid="ignore"):
        lost = parts[0] ** 2 / (first.shape[1] - 1) + parts[1] ** 2 / (second.shape[1] - 1)
        freedom = error**4 / lost
    return first.mean(1) - second.mean(1), error, freedom


def welch_interval(first: First, second: Second, level: float = 0.95) -> tuple[float, Interval | None]:
    """Return the difference of means, first minus second; no interval with fewer than two people in a group."""
    if min(len(first), len(second)) < 2:
        return float(first.mean() - second.mean()), None
    difference, error, freedom = (float(part[0]) for part in _welch(first[None], second[None]))
    margin = float(stats.t.ppf(0.5 + level / 2.0, freedom)) * error if error > 0.0 else 0.0
    method = "Welch's t on the people's values, taken as normal"
    return difference, Interval(difference - margin, difference + margin, level, method)


def ratio_effect(first: First, second: Second, groups: tuple[str, str], level: float = 0.95) -> Effect:
    """Ratio of geometric means, from the logarithms of people's medians."""
    difference, interval = welch_interval(first, second, level)
    if interval is not None and interval.low is not None and interval.high is not None:
        method = "Welch's t on the logarithms of the people's medians, taken as normal"
        interval = Interval(exp(interval.low), exp(interval.high), level, method)
    name = "ratio of geometric means"
    meaning = f"0.5 would mean that {groups[0]} deviate half as much as {groups[1]}; 1 means no difference."
    return Effect(name, exp(difference), "-", interval, meaning)


def welch_test(first: First, second: Second, alpha: float) -> Test | None:
    """Test beside the exact test; None with fewer than two people in a group."""
    if min(len(first), len(second)) < 2:
        return None
    p = float(welch_p(first[None], second[None])[0])
    seldom = f"such a difference occurs in {100 * p:.2g} % of studies without a difference between the groups"
    verdict = f"below {alpha:g}" if p <= alpha else f"not below {alpha:g}"
    return Test(
        name="Welch's t on logarithms",
        p=p,
        p_interval=None,
        p_min=None,
        p_min_reason="The test assumes that people's logarithms are normal, which cannot be checked with a few people.",
        text=p_text(p),
        sentence=f"If people's logarithms are normal, {seldom}: {verdict}. The exact test needs no such assumption.",
    )


def hedges_g(first: First, second: Second, level: float = 0.95) -> Effect | None:
    """Difference of means in standard deviations between people, with the exact correction for few people.

    The interval inverts the noncentral t distribution. None if people of a group do not differ at all.

    Source: Hedges 1981, J Educ Stat 6:107.
    """
    freedom = len(first) + len(second) - 2
    if min(len(first), len(second)) < 2:
        return None
    scatter = ((first - first.mean()) ** 2).sum() + ((second - second.mean()) ** 2).sum()
    if scatter <= 0.0:
        return None
    scale = sqrt(1.0 / len(first) + 1.0 / len(second))
    d = float(first.mean() - second.mean()) / sqrt(scatter / freedom)
    correction = exp(lgamma(freedom / 2.0) - lgamma((freedom - 1) / 2.0)) / sqrt(freedom / 2.0)
    ends = [scale * _noncentrality(d / scale, freedom, share) for share in (0.5 + level / 2.0, 0.5 - level / 2.0)]
    interval = Interval(ends[0], ends[1], level, "inverse of the noncentral t, people normal, groups of equal spread")
    meaning = (
        "Difference of log deviation, in standard deviations between people; negative: the first group's is smaller."
    )
    return Effect("Hedges' g", d * correction, "SD", interval, meaning)


def noncentral_t_cdf(t: float, freedom: int, noncentrality: float) -> float:
    """Share of the noncentral t distribution below `t`; SciPy's function gives NaN for a large noncentrality.

    E[Φ(t·s − noncentrality)],   s² ~ χ²(freedom) / freedom
    """
    scale, mass = _chi_nodes(freedom)
    return float(mass @ special.ndtr(t * scale - noncentrality))


@cache
def _chi_nodes(freedom: int) -> tuple[Float[np.ndarray, " node"], Float[np.ndarray, " node"]]:
    """Values of s and their probabilities."""
    # The integrand falls smoothly to zero at both ends, so the trapezoidal rule is exact to rounding with few nodes.
    low, high = stats.chi2.ppf(1e-15, freedom), stats.chi2.isf(1e-15, freedom)
    squares = np.geomspace(low, high, T_NODES)
    mass = squares * stats.chi2.pdf(squares, freedom)
    return np.sqrt(squares / freedom), mass / mass.sum()


def _noncentrality(t: float, freedom: int, share: float) -> float:
    """Return the noncentrality of the t distribution that has the probability `share` below `t`."""
    miss: Callable[[float], float] = lambda nc: noncentral_t_cdf(t, freedom, nc) - share  # noqa: E731
    low, high = t - 2.0, t + 2.0
    while miss(low) < 0.0:
        low -= abs(t) + 2.0
    while miss(high) > 0.0:
        high += abs(t) + 2.0
    return cast(float, optimize.brentq(miss, low, high))
