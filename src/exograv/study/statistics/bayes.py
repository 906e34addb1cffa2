"""Hierarchical model of log deviation, by quadrature: no sampling, so the same data always give the same result.

    touch ~ N(person, touch_sd²),   person ~ N(group, person_sd²),   difference of the groups ~ N(0, effect_sd²)

All distributions are normal for given standard deviations. These two lie on a grid, and the rest is in closed form.
Priors: level of both groups flat; person_sd half t with three degrees of freedom; touch_sd log-normal.
"""

from collections.abc import Callable
from dataclasses import dataclass
from math import exp, log
from typing import cast

import numpy as np
from jaxtyping import Float
from scipy import optimize, stats

from .findings import BayesFit, Interval, Posterior
from .random_intercept import SufficientStatistics

PERSON_NODES, TOUCH_NODES = 240, 25
PERSON_SD_MIN, PERSON_SD_MAX = 1e-3, 30.0
"""Ends of the grid [log units]."""

TOUCH_SD_MIDDLE, TOUCH_SD_FACTOR = 0.7, 2.0
"""Prior of touch_sd: median [log units], and the factor of one standard deviation. Hundreds of touches outweigh it."""

HALF_T_FREEDOM = 3

CONVENTION = "95 % intervals have equal tails: 2.5 % of the posterior lie below, 2.5 % above. Point values are medians."


@dataclass(frozen=True)
class StudyPrior:
    """Prior before any touch [log units]."""

    effect_sd: float = 1.0
    """Standard deviation of the difference. For 1.0, one group's deviation is 0.37 to 2.7 times the other's with a
    probability of two thirds.
    """

    person_scale: float = 0.5


SENSITIVITY = (
    StudyPrior(),
    StudyPrior(effect_sd=0.5),
    StudyPrior(effect_sd=2.0),
    StudyPrior(person_scale=0.25),
    StudyPrior(person_scale=1.0),
)
"""Priors. The first one is the quoted prior; the others are shown beside it."""


@dataclass(frozen=True)
class PosteriorGrid:
    """Posterior: a mixture of normal distributions of the difference, one per node."""

    weight: Float[np.ndarray, " node"]
    person_sd: Float[np.ndarray, " node"]
    touch_sd: Float[np.ndarray, " node"]
    mean: Float[np.ndarray, " node"]
    sd: Float[np.ndarray, " node"]

    def cdf(self, difference: float) -> float:
        """Return the probability that the difference is smaller than `difference`."""
        return float(self.weight @ stats.norm.cdf((difference - self.mean) / self.sd))

    def quantile(self, share: float) -> float:
        """Difference below which `share` of the posterior lies."""
        low, high = float((self.mean - 12.0 * self.sd).min()), float((self.mean + 12.0 * self.sd).max())
        miss: Callable[[float], float] = lambda difference: self.cdf(difference) - share  # noqa: E731
        return cast(float, optimize.brentq(miss, low, high))

    def person_sd_quantile(self, share: float) -> float:
        """Quantile of the standard deviation between people, interpolated between nodes in the logarithm."""
        sds, where = np.unique(self.person_sd, return_inverse=True)
        mass = np.bincount(where, self.weight)
        # Half of a node's mass lies below the node.
        return float(np.exp(np.interp(share, np.cumsum(mass) - mass / 2.0, np.log(sds))))

    def draw(self, n: int, rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Draw differences, standard deviations between people, and between touches, each (n,)."""
        node = rng.choice(len(self.weight), n, p=self.weight)
        return self.mean[node] + self.sd[node] * rng.normal(size=n), self.person_sd[node], self.touch_sd[node]


def posterior_grid(sums: SufficientStatistics, prior: StudyPrior) -> PosteriorGrid:
    """Compute the posterior of the one study in `sums`."""
    touches, means, squares = sums.touches[0], sums.mean[0], float(sums.squares[0])
    person_sd = np.geomspace(PERSON_SD_MIN, PERSON_SD_MAX, PERSON_NODES)
    touch_sd = _touch_nodes(float(touches.sum()) - len(touches), squares)
    both = np.stack([grid.ravel() for grid in np.meshgrid(person_sd, touch_sd, indexing="ij")])
    variance = both[0][:, None] ** 2 + both[1][:, None] ** 2 / touches
    weights = 1.0 / variance
    parts = [_group(weights[:, group], means[group]) for group in (slice(sums.n_first), slice(sums.n_first, None))]
    (total_a, mean_a, squares_a), (total_b, mean_b, squares_b) = parts
    # The flat prior of the level is integrated out, so the two group means enter only by their difference.
    of_data = 1.0 / total_a + 1.0 / total_b
    known = prior.effect_sd**2 + of_data
    log_touches = float(touches.sum()) - len(touches)
    log_weight = (
        -log_touches * np.log(both[1])
        - squares / (2.0 * both[1] ** 2)
        + 0.5 * np.log(weights).sum(1)
        - 0.5 * np.log(total_a * total_b * known)
        - 0.5 * (squares_a + squares_b + (mean_a - mean_b) ** 2 / known)
        + stats.t.logpdf(both[0] / prior.person_scale, HALF_T_FREEDOM)
        + stats.norm.logpdf(np.log(both[1] / TOUCH_SD_MIDDLE) / log(TOUCH_SD_FACTOR))
        + np.log(both[0])  # nodes are equally spaced in the logarithm; the prior of touch_sd is stated in it
    )
    weight = np.exp(log_weight - log_weight.max())
    share = prior.effect_sd**2 / known
    return PosteriorGrid(weight / weight.sum(), both[0], both[1], share * (mean_a - mean_b), np.sqrt(share * of_data))


def _group(weights: np.ndarray, means: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return summed precision, weighted mean, weighted squares about the mean; each (node,)."""
    total = weights.sum(1)
    mean = weights @ means / total
    return total, mean, (weights * (means - mean[:, None]) ** 2).sum(1)


def _touch_nodes(freedom: float, squares: float) -> Float[np.ndarray, " node"]:
    """Relevant standard deviations between touches: five standard errors about the estimate, in the logarithm."""
    if freedom < 1.0 or squares <= 0.0:
        return TOUCH_SD_MIDDLE * np.exp(np.linspace(-4.0, 4.0, TOUCH_NODES) * log(TOUCH_SD_FACTOR))
    prior_precision = 1.0 / log(TOUCH_SD_FACTOR) ** 2
    width = 5.0 / np.sqrt(2.0 * freedom + prior_precision)
    estimate = 0.5 * log(squares / freedom)
    middle = (2.0 * freedom * estimate + prior_precision * log(TOUCH_SD_MIDDLE)) / (2.0 * freedom + prior_precision)
    return np.exp(middle + np.linspace(-width, width, TOUCH_NODES))


def bayes_fit(
    sums: SufficientStatistics, groups: tuple[str, str], priors: tuple[StudyPrior, ...] = SENSITIVITY
) -> BayesFit:
    """Compute the posterior under each prior; the first prior is the quoted one."""
    posteriors = tuple(_posterior(posterior_grid(sums, prior), prior) for prior in priors)
    chances = [100.0 * posterior.p_smaller for posterior in posteriors]
    quoted = posteriors[0]
    sentence = (
        f"Under the quoted prior {groups[0]} deviate {quoted.ratio:.2f} times as much as {groups[1]} (95 % from "
        f"{quoted.interval.low:.2f} to {quoted.interval.high:.2f}) and less with a probability of {chances[0]:.1f} %; "
        f"under the others it is {min(chances):.1f} to {max(chances):.1f} %. "
        "With few people the prior influences this result; a probability is not a proof."
    )
    return BayesFit(posteriors, CONVENTION, sentence)


def _posterior(grid: PosteriorGrid, prior: StudyPrior) -> Posterior:
    low, middle, high = (exp(grid.quantile(share)) for share in (0.025, 0.5, 0.975))
    sd_low, sd_middle, sd_high = (grid.person_sd_quantile(share) for share in (0.025, 0.5, 0.975))
    method = "posterior, equal tails"
    return Posterior(
        effect_prior_sd=prior.effect_sd,
        person_prior_scale=prior.person_scale,
        ratio=middle,
        interval=Interval(low, high, 0.95, method),
        p_smaller=grid.cdf(0.0),
        person_sd=sd_middle,
        person_sd_interval=Interval(sd_low, sd_high, 0.95, method),
    )
