"""Ratio of two means over the same people, with an interval that is valid for any number of people."""

from dataclasses import dataclass
from math import sqrt

import numpy as np
from jaxtyping import Float
from scipy import stats

from .findings import Interval

Values = Float[np.ndarray, " person"]

NO_SPREAD = 1e-9
"""Share of a mean below which a difference between people is rounding error."""


@dataclass(frozen=True)
class Ratio:
    """Ratio of the mean of the numerator to the mean of the denominator."""

    value: float | None
    """Ratio; None if the denominator does not differ from 0."""

    interval: Interval | None
    reason: str
    """Reason why value or interval is missing; empty if both are given."""


def mean_interval(values: Values, level: float = 0.95) -> Interval | None:
    """Interval of the mean of normal values, by Student's t; None for fewer than two people."""
    n = len(values)
    if n < 2:
        return None
    margin = float(stats.t.ppf(0.5 + level / 2.0, n - 1)) * float(values.std(ddof=1)) / sqrt(n)
    mean = float(values.mean())
    return Interval(mean - margin, mean + margin, level, "Student's t over people")


def fieller(above: Values, below: Values, level: float = 0.95) -> Ratio:
    """Compute the ratio rho of the means of paired values, and its interval.

    The interval holds all rho for which a t test does not reject that `above - rho·below` is 0 on average:

        (mean(a) - rho·mean(b))² <= t²/n · var(a - rho·b)

    Exact for normal pairs. A bounded interval exists only if the mean below differs from 0 at that level.

    Source: Fieller 1954, J R Stat Soc B 16:175.
    """
    n = len(above)
    if n == 0:
        return Ratio(None, None, "no person has both values")
    a, b = float(above.mean()), float(below.mean())
    if b == 0.0:
        return Ratio(None, None, "the denominator is 0")
    if n == 1:
        return Ratio(a / b, None, "one person: the variation between people is unknown")
    spread = np.cov(above, below)
    if float(np.trace(spread)) <= (NO_SPREAD * (abs(a) + abs(b))) ** 2:
        return Ratio(
            a / b, None, "these people do not differ at all, so the variation between people cannot be estimated"
        )
    k = float(stats.t.ppf(0.5 + level / 2.0, n - 1)) ** 2 / n
    # leading·rho² - 2·middle·rho + last <= 0
    leading, middle, last = b * b - k * spread[1, 1], a * b - k * spread[0, 1], a * a - k * spread[0, 0]
    if leading <= 0.0:
        return Ratio(None, None, f"the denominator, {b:.3g}, does not differ from 0 with {n} people")
    root = sqrt(max(middle * middle - leading * last, 0.0))
    ends = (middle - root) / leading, (middle + root) / leading
    return Ratio(a / b, Interval(float(ends[0]), float(ends[1]), level, f"Fieller's, {n} people, pairs normal"), "")
