"""Exact tests over participants, and the intervals that belong to them."""

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
    """Whether the first people's mean differs from that of the others, by dealing all of them out again."""
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
    """The same on ranks, equal values sharing theirs."""
    return permutation_test(stats.rankdata(values), ways, alpha, RANKS if ways.is_complete else f"{RANKS}, drawn")


def _drawn_interval(values: Values, ways: Relabellings) -> tuple[float, float]:
    """99 %, of the p-value that all ways would give. Source: Clopper, Pearson 1934, Biometrika 26:404."""
    drawn = len(ways.in_first) - 1
    smaller = min(float(tail[0]) for tail in tails(values[None], ways))
    interval = stats.binomtest(round(smaller * (drawn + 1)) - 1, drawn).proportion_ci(0.99)
    return float(min(1.0, 2.0 * interval.low)), float(min(1.0, 2.0 * interval.high))


def _reason(n_first: int, n_second: int, p_min: float, ways: Relabellings) -> str:
    count, generic = comb(n_first + n_second, n_first), generic_smallest_p(n_first, n_second)
    if not ways.is_complete:
        return f"{len(ways.in_first):,} of {count:,} ways to form the groups were tried, so 2 of them is the least."
    reason = f"{n_first} against {n_second} people can be dealt out in {count:,} ways, so p is at least {generic:.3g}"
    if p_min > 1.001 * generic:
        reason += f"; equal values among these people raise that to {p_min:.3g}"
    return reason + "."


def shift_interval(values: Values, ways: Relabellings, level: float) -> Interval:
    """Differences of means that the permutation test does not reject: of the first people less the others.

    A way that takes some of the first group out and puts others in is as extreme as the data once the shift is the
    difference of the two subsets' means; the interval's ends are order statistics of these.
    """
    n_first, n = ways.n_first, len(values)
    others = ways.in_first[1:]
    stay = others[:, :n_first].sum(1)
    leaving = n_first - stay
    is_moved = leaving > 0  # drawn ways may repeat that of the data
    sums_in = others[:, n_first:] @ values[n_first:]
    sums_out = values[:n_first].sum() - others[:, :n_first] @ values[:n_first]
    shifts = np.sort(((sums_out - sums_in)[is_moved]) / leaving[is_moved])
    # Ways equal to the data count on both sides, whatever the shift.
    k = floor((1.0 - level) / 2.0 * len(ways.in_first) + 1e-9) - int((~is_moved).sum())
    method = f"shifts that the permutation test of {n_first} against {n - n_first} does not reject"
    if k < 1:
        return Interval(None, None, level, method + "; without bound, as it rejects none at this level")
    return Interval(float(shifts[k - 1]), float(shifts[-k]), level, method)


def pair_interval(values: Values, ways: Relabellings, level: float) -> tuple[float, Interval]:
    """Hodges–Lehmann difference, first less second, and the shifts that the rank test does not reject.

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
        return float(np.median(pairs)), Interval(None, None, level, method + "; without bound at this level")
    return float(np.median(pairs)), Interval(float(pairs[k - 1]), float(pairs[-k]), level, method)


def reachable_level(ways: Relabellings, level: float) -> float:
    """`level`, or the highest at which these intervals have ends: 0.9 for 3 against 3."""
    return min(level, 1.0 - 2.0 / len(ways.in_first))
