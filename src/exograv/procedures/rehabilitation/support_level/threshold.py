"""Posterior of the least support with which enough targets are reached, from successful and failed attempts.

    p_k(s) = lapse + (1 − 2 lapse) · logistic((s − t_k) / width),   t_k ~ N(person, spread)
    needed support: least s with mean over targets of p_k(s) ≥ criterion

Every target k has its own threshold t_k; the thresholds of one person share a mean. The posterior is computed on a
grid: it needs no sampling chain and no start value, and the same attempts give the same answer.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Int

LAPSE = 0.03
"""Share of attempts that fail or succeed for reasons other than weight [-]; assumed."""

WIDTHS = (0.01, 0.02, 0.04, 0.08)
SPREADS = (0.05, 0.12, 0.25)
"""Prior values of the logistic's width and of the thresholds' spread, all equally likely [share of the weight]."""

THRESHOLDS = np.arange(-0.5, 1.5001, 0.02)
"""Grid of thresholds [share of the weight]. Persons below 0 need no support; above 1 full support is not enough."""

PERSONS = np.arange(-0.4, 1.4001, 0.05)
DRAWS, DRAWS_LAST = 400, 4000
INSIDE = (-0.05, 1.05)
"""Range to which needed supports are clipped when an attempt is chosen: attempts cannot narrow values outside."""

Draws = Float[np.ndarray, "draw target"]


@dataclass(frozen=True)
class Posterior:
    """Posterior of one person, as equally likely draws."""

    thresholds: Draws
    widths: Float[np.ndarray, " draw"]
    needed: Float[np.ndarray, " draw"]
    """Needed support [share of the weight]; clipped to the ends of `THRESHOLDS`."""

    def interval(self) -> tuple[float, float, float]:
        """Median and 95 % interval of the needed support."""
        low, middle, high = np.quantile(self.needed, [0.025, 0.5, 0.975])
        return float(middle), float(low), float(high)

    def share(self, s: Float[np.ndarray, " support"]) -> Float[np.ndarray, "draw target support"]:
        """Probability of reaching each target at each support."""
        return chance((s - self.thresholds[:, :, None]) / self.widths[:, None, None])


def chance(x: np.ndarray) -> np.ndarray:
    """Probability of reaching a target, `x` widths above the threshold."""
    return LAPSE + (1.0 - 2.0 * LAPSE) * 0.5 * (1.0 + np.tanh(0.5 * x))


class ThresholdSearch:
    """Search of the threshold: takes attempts, gives the posterior, and chooses the most informative attempt."""

    def __init__(self, targets: int, criterion: float, seed: int):
        """Start from the prior.

        Args:
            targets: Number of targets.
            criterion: Share of them that must be reached [-].
            seed: Seed of the draws from the posterior; attempts in the same order give the same answer.
        """
        self.criterion, self._random = criterion, np.random.default_rng([seed, 11])
        spread = np.array(SPREADS)[:, None, None]
        prior = np.exp(-0.5 * ((THRESHOLDS - PERSONS[:, None]) / spread) ** 2)
        prior /= prior.sum(axis=2, keepdims=True)
        self._prior = prior.reshape(-1, len(THRESHOLDS))
        self._log_likelihood = np.zeros((len(WIDTHS), targets, len(THRESHOLDS)))

    def take(self, target: int, support: float, reached: bool) -> None:
        """Take one attempt at a target with this support [share of the weight]."""
        p = chance((support - THRESHOLDS) / np.array(WIDTHS)[:, None])
        self._log_likelihood[:, target] += np.log(p if reached else 1.0 - p)

    def posterior(self, draws: int = DRAWS) -> Posterior:
        """Return the posterior after the attempts so far."""
        top = self._log_likelihood.max(axis=2, keepdims=True)
        likelihood = np.exp(self._log_likelihood - top)
        evidence = np.log(likelihood @ self._prior.T).sum(axis=1) + top.sum(axis=(1, 2))[:, None]
        chosen = self._drawn_rows(np.exp(evidence - evidence.max()), draws)
        widths, persons = np.divmod(chosen, len(self._prior))
        weights = np.cumsum(likelihood[widths] * self._prior[persons][:, None, :], axis=2)
        u = self._random.random(weights.shape[:2]) * weights[:, :, -1]
        cell = np.minimum((weights < u[:, :, None]).sum(axis=2), len(THRESHOLDS) - 1)
        # Thresholds are drawn anywhere in the cell: differences below the grid's step must not appear certain.
        step = THRESHOLDS[1] - THRESHOLDS[0]
        thresholds = THRESHOLDS[cell] + step * (self._random.random(cell.shape) - 0.5)
        width = np.array(WIDTHS)[widths]
        return Posterior(thresholds, width, needed_support(thresholds, width, self.criterion))

    def most_telling(
        self, supports: Float[np.ndarray, " support"], seconds: Float[np.ndarray, " support"]
    ) -> tuple[int, float]:
        """Return target and support of the attempt with the largest expected drop of variance per time [s]."""
        found = self.posterior()
        needed = np.clip(found.needed, *INSIDE)
        p = found.share(supports)
        yes, no = (_variance_left(weight, needed) for weight in (p, 1.0 - p))
        gain = (needed.var() - yes - no) / seconds
        target, which = np.unravel_index(int(np.argmax(gain)), gain.shape)
        return int(target), float(supports[which])

    def _drawn_rows(self, weights: Float[np.ndarray, "width person"], draws: int) -> Int[np.ndarray, " draw"]:
        """Draw stratified rows: equal shares of draws for equal shares of probability."""
        edges = np.cumsum(weights.ravel())
        u = (np.arange(draws) + self._random.random(draws)) / draws * edges[-1]
        return np.minimum(np.searchsorted(edges, u), weights.size - 1)


def needed_support(
    thresholds: Draws, widths: Float[np.ndarray, " draw"], criterion: float
) -> Float[np.ndarray, " draw"]:
    """Least support at which the mean chance over targets is the criterion, by bisection."""
    low = np.full(len(thresholds), THRESHOLDS[0])
    high = np.full(len(thresholds), THRESHOLDS[-1])
    for _ in range(12):
        middle = 0.5 * (low + high)
        enough: Bool[np.ndarray, " draw"] = (
            chance((middle[:, None] - thresholds) / widths[:, None]).mean(axis=1) >= criterion
        )
        high, low = np.where(enough, middle, high), np.where(enough, low, middle)
    return 0.5 * (low + high)


def _variance_left(
    weights: Float[np.ndarray, "draw target support"], needed: Float[np.ndarray, " draw"]
) -> Float[np.ndarray, "target support"]:
    """Variance of the needed support after an outcome with these chances, times the chance of the outcome."""
    total = weights.mean(axis=0)
    first, second = (np.tensordot(needed**power, weights, axes=1) / len(needed) for power in (1, 2))
    return second - first**2 / np.maximum(total, 1e-12)
