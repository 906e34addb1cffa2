"""Limits of a comparison with this number of people."""

from collections.abc import Callable
from math import exp, log, sqrt
from typing import cast

import numpy as np
from jaxtyping import Float
from scipy import optimize, stats

from .normal import noncentral_t_cdf, welch_interval
from .relabelling import generic_smallest_p

First = Float[np.ndarray, " first"]
Second = Float[np.ndarray, " second"]

POWER = 0.8
EQUIVALENCE = 1.25
"""Largest ratio between groups that count as equal: the interval lies within 1/1.25 to 1.25."""

WIDEST = log(1000.0)
"""Largest difference of the search [log units]."""


def t_test_power(n_first: int, n_second: int, difference: float, sd: float, alpha: float = 0.05) -> float:
    """Power of Student's two-sided test; people are normal with standard deviation `sd` in both groups."""
    freedom = n_first + n_second - 2
    noncentrality = difference / (sd * sqrt(1.0 / n_first + 1.0 / n_second))
    critical = float(stats.t.ppf(1.0 - alpha / 2.0, freedom))
    below, above = (noncentral_t_cdf(-critical, freedom, sign * noncentrality) for sign in (1.0, -1.0))
    return below + above


def detectable_difference(n_first: int, n_second: int, sd: float, alpha: float = 0.05) -> float | None:
    """Difference that Student's test finds in 80 % of studies; None if it is a factor of 1000 or more."""
    lack: Callable[[float], float] = lambda d: t_test_power(n_first, n_second, d, sd, alpha) - POWER  # noqa: E731
    return None if sd <= 0.0 or lack(WIDEST) < 0.0 else cast(float, optimize.brentq(lack, 0.0, WIDEST))


def people_sd(first: First, second: Second) -> float | None:
    """Pooled standard deviation between people of a group; None with fewer than two people in each."""
    freedom = len(first) + len(second) - 2
    if min(len(first), len(second)) < 2:
        return None
    return sqrt(float(((first - first.mean()) ** 2).sum() + ((second - second.mean()) ** 2).sum()) / freedom)


def limits(first: First, second: Second, touches: int, alpha: float, p_min: float) -> tuple[str, ...]:
    """Return sentences on the limits, computed from people's log deviations and from their number."""
    n_first, n_second = len(first), len(second)
    sentences = [
        f"{touches} touches come from {n_first + n_second} people. Touches of one person are similar, so people are "
        "compared, and more touches give little more information about the groups."
    ]
    if p_min > alpha + 1e-12:
        n = next(n for n in range(2, 50) if generic_smallest_p(n, n) <= alpha)
        sentences.append(
            f"An exact test of {n_first} against {n_second} people cannot reach {alpha:g}: its smallest p is "
            f"{p_min:.3g}, even if all people of one group are better. At least {n} against {n} are needed."
        )
    sd = people_sd(first, second)
    if sd is None:
        return (*sentences, "With one person in a group the variation between people is unknown: there is no interval.")
    _, interval = welch_interval(first, second)
    if interval is not None and interval.low is not None and interval.high is not None:
        sentences.append(
            f"The ratio lies between {exp(interval.low):.2g} and {exp(interval.high):.2g} (95 %), a factor "
            f"of {exp(interval.high - interval.low):.2g} from end to end."
        )
    if (found := detectable_difference(n_first, n_second, sd, alpha)) is not None:
        sentences.append(
            f"People of a group differ by a factor of {exp(sd):.2f} (standard deviation {sd:.2f} log units, itself "
            f"uncertain). If this is right, a t test finds an effect in {100 * POWER:.0f} % of such studies only if "
            f"the deviation is {exp(-found):.2g} times as large or smaller, or {exp(found):.2g} times or larger."
        )
    return (*sentences, _equivalence(first, second, alpha))


def _equivalence(first: First, second: Second, alpha: float) -> str:
    """Test of equivalence by two one-sided tests. Source: Schuirmann 1987, J Pharmacokinet Biopharm 15:657."""
    _, interval = welch_interval(first, second, 1.0 - 2.0 * alpha)
    alike = f"between {1.0 / EQUIVALENCE:g} and {EQUIVALENCE:g}"
    if interval is None or interval.low is None or interval.high is None:
        return f"Equivalence of the groups, a ratio {alike}, cannot be shown."
    ends = f"{exp(interval.low):.2g} to {exp(interval.high):.2g}"
    is_alike = max(-interval.low, interval.high) < log(EQUIVALENCE)
    verdict = "is shown, if people's logarithms are normal" if is_alike else "is not shown either"
    return f"Equivalence of the groups, a ratio {alike}, {verdict}: the {100 - 200 * alpha:g} % interval is {ends}."
