"""Relabellings: all ways to assign the people to the two groups, or many of them drawn at random."""

from dataclasses import dataclass
from itertools import chain, combinations
from math import comb

import numpy as np
from jaxtyping import Bool, Float

COUNTED_MAX = 200_000
"""Number of relabellings up to which all are enumerated: 10 against 10 people have 184 756."""

DRAWN = 99_999
"""Number of relabellings that are drawn otherwise, in addition to that of the data."""

CELLS_MAX = 20_000_000
"""Numbers in memory at once: 160 MB."""


@dataclass(frozen=True)
class Relabellings:
    """Ways to assign people to two groups of given sizes. Row 0 is that of the data, its first people first."""

    in_first: Bool[np.ndarray, "labelling person"]
    is_complete: bool
    """True if every relabelling occurs exactly once. Otherwise row 0 is followed by relabellings drawn at random."""

    @property
    def n_first(self) -> int:
        """Number of people in the first group."""
        return int(self.in_first[0].sum())


def relabellings(
    n_first: int, n_second: int, rng: np.random.Generator, counted_max: int = COUNTED_MAX, drawn: int = DRAWN
) -> Relabellings:
    """Return all relabellings if there are at most `counted_max`, otherwise that of the data and `drawn` at random."""
    n = n_first + n_second
    if (ways := comb(n, n_first)) <= counted_max:
        flat = np.fromiter(chain.from_iterable(combinations(range(n), n_first)), int, ways * n_first)
        in_first = np.zeros((ways, n), bool)
        np.put_along_axis(in_first, flat.reshape(ways, n_first), True, 1)
        return Relabellings(in_first, True)
    as_it_is = np.arange(n) < n_first
    return Relabellings(np.vstack([as_it_is, rng.permuted(np.tile(as_it_is, (drawn, 1)), axis=1)]), False)


def tails(
    values: Float[np.ndarray, "study person"], ways: Relabellings
) -> tuple[Float[np.ndarray, " study"], Float[np.ndarray, " study"]]:
    """Share of the relabellings whose first group has at least the sum of the data's first group, and at most this sum.

    Sums that differ by rounding only are equal: people with the same value must not count as different.
    """
    weights = ways.in_first.T.astype(float)
    tolerance = 1e-9 * np.abs(values).sum(1, keepdims=True)
    at_least, at_most = np.empty(len(values)), np.empty(len(values))
    step = max(1, CELLS_MAX // weights.shape[1])
    for start in range(0, len(values), step):
        part = slice(start, start + step)
        sums = values[part] @ weights
        at_least[part] = (sums >= sums[:, :1] - tolerance[part]).mean(1)
        at_most[part] = (sums <= sums[:, :1] + tolerance[part]).mean(1)
    return at_least, at_most


def two_sided(values: Float[np.ndarray, "study person"], ways: Relabellings) -> Float[np.ndarray, " study"]:
    """Permutation p-values of the difference of the groups' means: twice the smaller tail, at most 1.

    Source: Phipson, Smyth 2010, Stat Appl Genet Mol Biol 9:39, for drawn relabellings: the data's own is one of them.
    """
    at_least, at_most = tails(values, ways)
    return np.minimum(1.0, 2.0 * np.minimum(at_least, at_most))


def smallest_p(values: Float[np.ndarray, " person"], ways: Relabellings) -> float:
    """Smallest two-sided p-value that any grouping of these people could give; equal values make it larger."""
    sums = ways.in_first @ values
    tolerance = 1e-9 * np.abs(values).sum()
    ends = [np.count_nonzero(sums >= sums.max() - tolerance), np.count_nonzero(sums <= sums.min() + tolerance)]
    return min(1.0, 2.0 * float(min(ends)) / len(sums)) if ways.is_complete else 2.0 / len(sums)


def generic_smallest_p(n_first: int, n_second: int) -> float:
    """Smallest p-value for people who all differ: 2 / C(n, n_first)."""
    return min(1.0, 2.0 / comb(n_first + n_second, n_first))
