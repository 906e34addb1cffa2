"""Tail-averaged greedy Kaczmarz: repeated projections onto strongly violated equations of a time window."""

from collections import deque
from collections.abc import Mapping
from types import MappingProxyType

import numpy as np
from jaxtyping import Float

from exograv.identification.core.interface import Estimate, Sample
from exograv.identification.core.sample_pace import BATCH_PERIOD_S, Averages
from exograv.identification.core.setting import Setting
from exograv.identification.core.whitened_model import Unknowns, WhitenedModel

CANDIDATES: tuple[Mapping[str, float], ...] = tuple(
    MappingProxyType({"window_s": window_s, "ridge": ridge}) for window_s in (1.0, 4.0) for ridge in (1e-2, 1e-1, 1.0)
)
WINDOW_S, RIDGE = 4.0, 1e-2
"""Length of the window of equations [s], and weight of the prior's equations, as a share of the mean square of the
others [-]; from python benchmarks/tune_methods.py."""

ROUND_EVERY = 4  # snapshots

TURNING = 0.1
"""Share of the uncertainty at rest below which a joint's direction of motion counts as known [-]."""

SEED = 20_251_004
"""Seed of the choice among violated equations; it belongs to the method, not to the data."""


class Kaczmarz:
    """Method TAG-K, run every 0.32 s on the equations H ξ = y of the last `window_s` seconds and √λ ξ = 0.

        ξ += h (y − hᵀξ) / hᵀh,  of an equation drawn among those with (y − hᵀξ)² ≥ ε ‖r‖² hᵀh by their squared error,
        ε = ½ (max (y − hᵀξ)²/hᵀh / ‖r‖² + 1/‖H‖²),

    with as many projections as equations and one snapshot in 0.08 s. The published estimate is the mean of all these ξ.
    As in the paper, the newest snapshots are stacked, λ is a share of ‖H‖² per equation, and a round starts from the
    last ξ. The paper leaves the number of snapshots and the time between rounds to the user. Its unknowns are the ten
    of one body. Ours have no common unit, so ξ is in the prior's scale, and λ pulls towards the prior. Estimates are
    not projected onto possible bodies; the paper gates its estimates instead. It states no uncertainty.

    Source: Sha et al., arXiv 2510.04839 (TAG-K with Tikhonov rows); Bai & Wu 2018, SIAM J. Sci. Comput. 40:A592 (ε).
    """

    name = "kaczmarz"

    def __init__(self, setting: Setting, window_s: float = WINDOW_S, ridge: float = RIDGE):
        self._model, self._ridge = WhitenedModel(setting), ridge
        self._torque = setting.model
        self._rows: deque[tuple[np.ndarray, np.ndarray]] = deque(maxlen=max(1, round(window_s / BATCH_PERIOD_S)))
        self._xi = np.zeros(self._model.count)
        self._tail = self._xi.copy()
        self._snapshots = 0
        self._generator = np.random.default_rng(SEED)
        self._averages, self._t = Averages(BATCH_PERIOD_S), 0.0

    def update(self, sample: Sample) -> None:
        """Add the equations of each 0.08 s to the window; run a round every fourth time."""
        self._t = sample.t
        mean = self._averages.take(sample)
        if mean is None:
            return
        error, H = self._model.rows(mean, self._tail)
        # A projection fulfils its equation exactly, so the uncertain equation of a joint about to reverse is left out.
        unsure = self._torque.direction_uncertainty(mean.v)
        told = unsure <= TURNING * self._torque.direction_uncertainty(np.zeros_like(mean.v))
        self._rows.append((H[told], (error + H @ self._tail)[told]))
        self._snapshots += 1
        if self._snapshots % ROUND_EVERY == 0:
            self._go_round()

    def _go_round(self) -> None:
        A = np.concatenate([H for H, _ in self._rows])
        y = np.concatenate([y for _, y in self._rows])
        if len(A) == 0:
            return
        weight = np.sqrt(self._ridge * (A**2).sum() / len(A))
        A = np.concatenate([A, weight * np.eye(self._model.count)])
        y = np.concatenate([y, np.zeros(self._model.count)])
        self._xi, self._tail = tail_average(A, y, self._xi, self._generator)

    def estimate(self) -> Estimate:
        """Return the mean of the newest round; its bodies may be physically impossible."""
        return Estimate(self._t, self._model.x(self._tail), None, 0.0, 1.0)


def tail_average(
    A: Float[np.ndarray, "row unknown"],
    y: Float[np.ndarray, " row"],
    xi: Unknowns,
    generator: np.random.Generator,
) -> tuple[Unknowns, Unknowns]:
    """Make as many greedy projections from `xi` as A ξ = y has rows; return the last ξ and the mean of all."""
    norms = np.maximum((A**2).sum(axis=1), 1e-300)
    least = 1.0 / norms.sum()
    # The Gram matrix of all rows: each projection then costs one row of it, not a product with A.
    gram = A @ A.T
    left = y - A @ xi
    moves, total = np.zeros(len(A)), np.zeros(len(A))
    draws = generator.random(len(A))
    for draw in draws:
        squares = left**2
        size = squares.sum()
        if size <= 0.0:
            break
        share = squares / norms
        violated = np.where(share >= 0.5 * (share.max() + size * least), squares, 0.0)
        chances = violated.cumsum()
        row = int(np.searchsorted(chances, draw * chances[-1], side="right"))
        row = min(row, len(A) - 1)
        move = left[row] / norms[row]
        moves[row] += move
        left -= move * gram[row]
        total += moves
    return xi + A.T @ moves, xi + A.T @ total / len(A)
