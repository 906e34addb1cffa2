"""Identifiability: which parameter combinations the data determined, and which the prior determined."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from jaxtyping import Float
from scipy.linalg import qr, solve_triangular

from .interface import Covariance, Parameters
from .square_root import square_root

TOLD = 0.5
"""Largest posterior standard deviation of a parameter that the data determined, as a share of the prior's [-]."""

CONFUSED = 0.9
"""Correlation above which the data cannot distinguish two parameters [-]."""

SHOWN = 0.1
"""Smallest weight in a combination that is listed, in prior standard deviations [-]."""


@dataclass(frozen=True)
class BaseParameter:
    """Combination of parameters that is known better from the data than from the prior."""

    weights: dict[str, float]
    """Weights by parameter name; the first is 1."""

    value: float
    sd: float
    """Standard deviation, in the unit of the first parameter."""


@dataclass(frozen=True)
class Identifiability:
    """Identifiability of an estimate: which part of it was measured."""

    learned: int
    """Number of parameters that could be learned [-]."""

    base: tuple[BaseParameter, ...]
    """Independent combinations that the data determined, the most certain first."""

    condition: float
    """Condition number of the weighted regressor over those combinations: largest by smallest singular value [-]."""

    left: dict[str, float]
    """Posterior over prior standard deviation, by parameter [-]."""

    confused: tuple[tuple[str, str, float], ...]
    """Pairs that the data cannot separate, with their correlation; the prior did not correlate them."""

    @property
    def by_data(self) -> tuple[str, ...]:
        """Parameters that the data determined."""
        return tuple(name for name, left in self.left.items() if left < TOLD)

    @property
    def by_prior(self) -> tuple[str, ...]:
        """Parameters whose value comes mostly from the prior."""
        return tuple(name for name, left in self.left.items() if left >= TOLD)


def identifiability(names: Sequence[str], prior: Covariance, posterior: Covariance, x: Parameters) -> Identifiability:
    """Compare the prior with the posterior.

    The difference of the two information matrices is the information of the data. A pivoted QR of its square root, each
    column in units of the prior's standard deviation, selects independent parameters and the other parameters that
    each of them contains: base parameters (Gautier 1991). Combinations that the prior knows better are cut.

    Args:
        names: Parameter names, as from `dynamics.parameters.names_and_units`.
        prior: Covariance before the motion (parameter, parameter).
        posterior: Covariance after it.
        x: Estimate (parameter,).
    """
    sd = np.sqrt(np.diag(prior))
    free = np.flatnonzero(sd > 0.0)
    regressor = _data_square_root(prior[np.ix_(free, free)], posterior[np.ix_(free, free)]) * sd[free]
    decomposed: Any = qr(regressor, mode="r", pivoting=True)  # the return type depends on the arguments
    R, order = np.asarray(decomposed[0]), np.asarray(decomposed[1])
    singular = np.abs(np.diag(R))
    rank = int((singular > 1.0).sum())
    carried = solve_triangular(R[:rank, :rank], R[:rank, rank:])
    chosen, other = free[order[:rank]].tolist(), free[order[rank:]]
    base = []
    for i, entry in enumerate(chosen):
        weights = np.zeros(len(sd))
        weights[entry] = 1.0
        large = np.abs(carried[i]) > SHOWN
        weights[other[large]] = carried[i, large] * sd[entry] / sd[other[large]]
        spread = float(np.sqrt(weights @ posterior @ weights))
        by_name = {names[int(j)]: float(weights[int(j)]) for j in (entry, *other[large])}
        base.append(BaseParameter(by_name, float(weights @ x), spread))
    values = np.linalg.svd(regressor, compute_uv=False)
    condition = float(values[0] / values[rank - 1]) if rank else float("nan")
    left = np.sqrt(np.maximum(np.diag(posterior)[free], 0.0)) / sd[free]
    shares = {names[int(j)]: float(share) for j, share in zip(free, left, strict=True)}
    return Identifiability(len(free), tuple(base), condition, shares, _confused(names, free, prior, posterior))


def _data_square_root(prior: Covariance, posterior: Covariance) -> Float[np.ndarray, "row parameter"]:
    """Square root of the information of the data: the sum of the rows' outer products equals it."""
    L = square_root(prior)
    inverse = np.linalg.pinv(L)
    told = np.linalg.inv(inverse @ posterior @ inverse.T) - np.eye(L.shape[1])
    values, vectors = np.linalg.eigh(0.5 * (told + told.T))
    return np.sqrt(np.maximum(values, 0.0))[:, None] * vectors.T @ inverse


def _confused(
    names: Sequence[str], free: np.ndarray, prior: Covariance, posterior: Covariance
) -> tuple[tuple[str, str, float], ...]:
    after, before = (_correlation(covariance[np.ix_(free, free)]) for covariance in (posterior, prior))
    high = np.triu((np.abs(after) > CONFUSED) & (np.abs(before) < CONFUSED), k=1)
    pairs = sorted(np.argwhere(high).tolist(), key=lambda pair: -abs(after[pair[0], pair[1]]))
    known = [names[int(j)] for j in free]
    return tuple((known[i], known[j], float(after[i, j])) for i, j in pairs)


def _correlation(covariance: Covariance) -> Float[np.ndarray, "parameter parameter"]:
    sd = np.sqrt(np.diag(covariance))
    return covariance / np.outer(sd, sd)
