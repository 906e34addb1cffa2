"""Exact tests over participants, and the corresponding intervals."""

from math import comb, floor

import numpy as np
from jaxtyping import Float
from scipy import stats

from .findings import DRAWN, EXACT, Interval, Test
from .relabelling import Relabellings, generic_smallest_p, smallest_p, tails, two_sided
from .wording import p_text, verdict

RANKS = "exact Mann–Whitney"

Values = Float[np.ndarray, " person"]


def permutation_test(values: Values, ways: Relabellings, alpha: float, name: str = EXACT) -> Test:
    """Test for a difference between the first people's mean and that of the others, by relabelling all people."""
    p = float(two_sided(values[None], ways)[0])
    p_min = smallest_p(values, ways)
    n_first, n = ways.n_first, len(values)
    name = name if ways.is_complete or name != EXACT else DRAWN
    return Test(
        name=name,
        p=p,
        p_interval=None if ways.is_complete else _drawn_interval(values, ways),
        p_min=p_min,
        p_min_reason=_reason(n_first, n - n_first, p_min, ways),
        text=p_text(p, p_min),
        sentence=verdict(p, p_min, alpha, n_first, n - n_first),
    )


def rank_test(values: Values, ways: Relabellings, alpha: float) -> Test:
    """Test the ranks in the same way; equal values share their rank."""
    return permutation_test(stats.rankdata(values), ways, alpha, RANKS if ways.is_complete else f"{RANKS}, drawn")


def _drawn_interval(values: Values, ways: Relabellings) -> tuple[float, float]:
    """99 % interval of the p-value that all relabellings would give.

    Source: Clopper, Pearson 1934, Biometrika 26:404.
    """
    drawn = len(ways.in_first) - 1
    smaller = min(float(tail[0]) for tail in tails(values[None], ways))
    interval = stats.binomtest(round(smaller * (drawn + 1)) - 1, drawn).proportion_ci(0.99)
    return float(min(1.0, 2.0 * interval.low)), float(min(1.0, 2.0 * interval.high))


def _reason(n_first: int, n_second: int, p_min: float, ways: Relabellings) -> str:
    count, generic = comb(n_first + n_second, n_first), generic_smallest_p(n_first, n_second)
    if not ways.is_complete:
        return f"{len(ways.in_first):,} of {count:,} ways to form the groups were tried; p is at least that of 2."
    reason = f"{n_first} against {n_second} people can be assigned in {count:,} ways, so p is at least {generic:.3g}"
    if p_min > 1.001 * generic:
        reason += f"; equal values among these people raise this bound to {p_min:.3g}"
    return reason + "."


def shift_interval(values: Values, ways: Relabellings, level: float) -> Interval:
    """Shifts of the means, first people minus the others, that the permutation test does not reject.

    A relabelling exchanges a subset of the first group for others. It is as extreme as the data if the shift is the
    difference of the two subsets' means. The interval's ends are order statistics of these differences.
    """
    n_first, n = ways.n_first, len(values)
    others = ways.in_first[1:]
    stay = others[:, :n_first].sum(1)
    leaving = n_first - stay
    is_moved = leaving > 0  # Drawn relabellings may repeat that of the data.
    sums_in = others[:, n_first:] @ values[n_first:]
    sums_out = values[:n_first].sum() - others[:, :n_first] @ values[:n_first]
    shifts = np.sort(((sums_out - sums_in)[is_moved]) / leaving[is_moved])
    # Relabellings equal to the data count on both sides for any shift.
    k = floor((1.0 - level) / 2.0 * len(ways.in_first) + 1e-9) - int((~is_moved).sum())
    method = f"shifts that the permutation test of {n_first} against {n - n_first} does not reject"
    if k < 1:
        return Interval(None, None, level, method + "; unbounded, as the test rejects none at this level")
    return Interval(float(shifts[k - 1]), float(shifts[-k]), level, method)


def pair_interval(values: Values, ways: Relabellings, level: float) -> tuple[float, Interval]:
    """Hodges–Lehmann difference, first minus second, and the shifts that the rank test does not reject.

    Source: Hodges, Lehmann 1963, Ann Math Stat 34:598.
    """
    n_first, n = ways.n_first, len(values)
    pairs = np.sort((values[:n_first, None] - values[None, n_first:]).ravel())
    sums = ways.in_first @ np.arange(1.0, n + 1.0)
    beaten = sums - n_first * (n_first + 1) / 2.0
    k = 0
    while (beaten <= k).mean() <= (1.0 - level) / 2.0 + 1e-12:
        k += 1
    method = f"shifts that the rank test of {n_first} against {n - n_first} does not reject"
    if k == 0:
        return float(np.median(pairs)), Interval(None, None, level, method + "; unbounded at this level")
    return float(np.median(pairs)), Interval(float(pairs[k - 1]), float(pairs[-k]), level, method)


def reachable_level(ways: Relabellings, level: float) -> float:
    """Return `level`, or the highest level at which these intervals are bounded: 0.9 for 3 against 3."""
    return min(level, 1.0 - 2.0 / len(ways.in_first))
