"""Ratio of two means over the same people, with the interval that holds however few they are."""

from dataclasses import dataclass
from math import sqrt

import numpy as np
from jaxtyping import Float
from scipy import stats

from .findings import Interval

Values = Float[np.ndarray, " person"]

NO_SPREAD = 1e-9
"""Share of a mean below which people do not differ: rounding."""


@dataclass(frozen=True)
class Ratio:
    """Of the mean above to the mean below."""

    value: float | None
    """None where the mean below cannot be told from 0."""

    interval: Interval | None
    reason: str
    """Why there is no value, or no interval; empty where there are both."""


def mean_interval(values: Values, level: float = 0.95) -> Interval | None:
    """Of the mean of normal values, by Student's t; None for fewer than two people."""
    n = len(values)
    if n < 2:
        return None
    margin = float(stats.t.ppf(0.5 + level / 2.0, n - 1)) * float(values.std(ddof=1)) / sqrt(n)
    mean = float(values.mean())
    return Interval(mean - margin, mean + margin, level, "Student's t over people")


def fieller(above: Values, below: Values, level: float = 0.95) -> Ratio:
    """Ratio rho of means of paired values, and all rho for which a t test takes `above - rho·below` for 0 on average.

        (mean(a) - rho·mean(b))² <= t²/n · var(a - rho·b)

    Exact for normal pairs. An interval with two ends exists only where the mean below differs from 0 at that level.

    Source: Fieller 1954, J R Stat Soc B 16:175.
    """
    n = len(above)
    if n == 0:
        return Ratio(None, None, "nobody has both")
    a, b = float(above.mean()), float(below.mean())
    if b == 0.0:
        return Ratio(None, None, "what it is divided by is 0")
    if n == 1:
        return Ratio(a / b, None, "one person: nothing is known of how people differ")
    spread = np.cov(above, below)
    if float(np.trace(spread)) <= (NO_SPREAD * (abs(a) + abs(b))) ** 2:
        return Ratio(a / b, None, "these people do not differ at all: how much others would cannot be told")
    k = float(stats.t.ppf(0.5 + level / 2.0, n - 1)) ** 2 / n
    # leading·rho² - 2·middle·rho + last <= 0
    leading, middle, last = b * b - k * spread[1, 1], a * b - k * spread[0, 1], a * a - k * spread[0, 0]
    if leading <= 0.0:
        return Ratio(None, None, f"what it is divided by, {b:.3g}, cannot be told from 0 with {n} people")
    root = sqrt(max(middle * middle - leading * last, 0.0))
    ends = (middle - root) / leading, (middle + root) / leading
    return Ratio(a / b, Interval(float(ends[0]), float(ends[1]), level, f"Fieller's, {n} people, pairs normal"), "")
