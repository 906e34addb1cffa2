"""Paired comparison: each person under two conditions, tested by exchanging the conditions of some people."""

from dataclasses import dataclass
from math import exp, floor

import numpy as np
from jaxtyping import Bool, Float

from .findings import Interval
from .wording import ROUNDING, p_text

ENUMERATED_MAX = 17
"""Number of people up to which all exchanges are enumerated: 131 072."""

DRAWN = 99_999
"""Number of exchanges that are drawn otherwise, in addition to that of the data."""

CELLS_MAX = 20_000_000
"""Numbers in memory at once: 160 MB."""

Differences = Float[np.ndarray, " person"]


@dataclass(frozen=True)
class Exchanges:
    """Sets of people whose conditions are exchanged. Row 0 exchanges nobody's."""

    is_exchanged: Bool[np.ndarray, "exchange person"]
    is_complete: bool
    """True if every set occurs exactly once. Otherwise row 0 is followed by sets drawn at random."""


@dataclass(frozen=True)
class PairedFinding:
    """Result of a paired comparison of logarithms."""

    people: int
    ratio: float
    """Geometric mean over people of the first condition divided by the second."""

    interval: Interval
    """Ratios that the test does not reject."""

    p: float
    p_min: float
    """Smallest p-value that this number of people allows."""

    text: str
    """P-value as it may be printed."""

    sentence: str


def exchanges(people: int, rng: np.random.Generator) -> Exchanges:
    """Return all exchanges of at most `ENUMERATED_MAX` people, otherwise that of the data and `DRAWN` at random."""
    if people <= ENUMERATED_MAX:
        numbers = np.arange(2**people)[:, None]
        return Exchanges((numbers >> np.arange(people)) & 1 == 1, True)
    drawn = rng.random((DRAWN, people)) < 0.5
    return Exchanges(np.vstack([np.zeros(people, bool), drawn]), False)


def paired_p(differences: Float[np.ndarray, "study person"], ways: Exchanges) -> Float[np.ndarray, " study"]:
    """Two-sided p-values of the hypothesis that the differences are symmetric about 0.

    Source: Fisher 1935, The Design of Experiments, section 21. The data's own exchange is one of them.
    """
    signs = 1.0 - 2.0 * ways.is_exchanged.T
    tolerance = 1e-9 * np.abs(differences).sum(1, keepdims=True)
    found = np.empty(len(differences))
    step = max(1, CELLS_MAX // signs.shape[1])
    for start in range(0, len(differences), step):
        part = slice(start, start + step)
        sums = differences[part] @ signs
        at_least = (sums >= sums[:, :1] - tolerance[part]).mean(1)
        at_most = (sums <= sums[:, :1] + tolerance[part]).mean(1)
        found[part] = np.minimum(1.0, 2.0 * np.minimum(at_least, at_most))
    return found


def paired_interval(differences: Differences, ways: Exchanges, level: float) -> Interval:
    """Shifts of the differences that the test does not reject.

    An exchange is as extreme as the data if the shift is the mean difference of the exchanged people. The interval's
    ends are order statistics of these means.

    Source: Hartigan 1969, J Am Stat Assoc 64:1303.
    """
    counts = ways.is_exchanged.sum(1)
    is_moved = counts > 0
    shifts = np.sort((ways.is_exchanged[is_moved] @ differences) / counts[is_moved])
    k = floor((1.0 - level) / 2.0 * len(counts) + 1e-9) - int((~is_moved).sum()) + 1
    method = f"ratios that the paired test of {len(differences)} people does not reject"
    if k < 1:
        return Interval(None, None, level, method + "; unbounded, as the test rejects none at this level")
    return Interval(float(shifts[k - 1]), float(shifts[-k]), level, method)


def paired_comparison(differences: Differences, alpha: float, seed: int = 0) -> PairedFinding:
    """Compare two conditions by one difference of logarithms per person, at least one person."""
    ways = exchanges(len(differences), np.random.default_rng(seed))
    p, n = float(paired_p(differences[None], ways)[0]), len(differences)
    p_min = min(1.0, 2.0 / len(ways.is_exchanged))
    shifts = paired_interval(differences, ways, 1.0 - alpha)
    ratio, said = exp(float(differences.mean())), _sentence(p, p_min, alpha, n)
    return PairedFinding(n, ratio, ratio_interval(shifts), p, p_min, p_text(p, p_min), said)


def ratio_interval(shifts: Interval) -> Interval:
    """Return the interval of a ratio from that of its logarithm."""
    low, high = (None if end is None else exp(end) for end in (shifts.low, shifts.high))
    return Interval(low, high, shifts.level, shifts.method)


def _sentence(p: float, p_min: float, alpha: float, people: int) -> str:
    if p_min > alpha + ROUNDING:
        return (
            f"With {people} people this test cannot reach {alpha:g}, however large the effect: its smallest p is "
            f"{p_min:.3g}. So the test neither shows a difference nor excludes one."
        )
    said = f"Random exchange of the conditions of {people} people gives a difference as large as this in "
    said += f"{100 * p:.2g} % of cases."
    return said if p <= alpha + ROUNDING else f"{said} No difference is shown, and none is excluded."
