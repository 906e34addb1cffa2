"""The posterior is calibrated: true values drawn from the prior have uniform ranks in it."""

import numpy as np
import pytest
from scipy import integrate, stats

from exograv.study.statistics.bayes import TOUCH_SD_FACTOR, TOUCH_SD_MIDDLE, StudyPrior, bayes_fit, posterior_grid
from exograv.study.statistics.random_intercept import SufficientStatistics

WORLDS = 400


def world(
    prior: StudyPrior, touches: np.ndarray, n_first: int, rng: np.random.Generator
) -> tuple[SufficientStatistics, float, float]:
    """Draw a study from the prior: statistics, true difference, true standard deviation between people."""
    difference = prior.effect_sd * rng.normal()
    person_sd = abs(prior.person_scale * rng.standard_t(3))
    touch_sd = TOUCH_SD_MIDDLE * TOUCH_SD_FACTOR ** rng.normal()
    # The level's prior is flat, so any level is valid.
    people = 4.0 + person_sd * rng.normal(size=len(touches)) + difference * (np.arange(len(touches)) < n_first)
    means = people + touch_sd / np.sqrt(touches) * rng.normal(size=len(touches))
    squares = touch_sd**2 * rng.chisquare(touches.sum() - len(touches))
    return SufficientStatistics(touches[None], means[None], np.array([squares]), n_first), difference, person_sd


@pytest.mark.parametrize("touches", [(40.0, 40.0, 40.0, 40.0, 40.0, 40.0), (3.0, 12.0, 60.0, 8.0, 30.0)])
def test_truths_from_the_prior_fall_anywhere_in_the_posterior(touches: tuple[float, ...]):
    """Run simulation-based calibration: Talts et al. 2018, arXiv:1804.06788."""
    rng, prior = np.random.default_rng(1000), StudyPrior(effect_sd=0.8, person_scale=0.4)
    ranks, sd_ranks = [], []
    for _ in range(WORLDS):
        sums, difference, person_sd = world(prior, np.array(touches), 3, rng)
        grid = posterior_grid(sums, prior)
        ranks.append(grid.cdf(difference))
        sd_ranks.append(float(grid.weight[grid.person_sd < person_sd].sum()))
    # For each quantity, four in a thousand correct samplers would fail by chance.
    assert stats.kstest(ranks, "uniform").pvalue > 0.004
    assert stats.kstest(sd_ranks, "uniform").pvalue > 0.004


def test_quadrature_agrees_with_plain_integration_over_everything():
    touches, means, n_first = np.array([2.0, 3.0, 2.0]), np.array([3.6, 4.1, 4.8]), 2
    sums, prior = SufficientStatistics(touches[None], means[None], np.array([0.9]), n_first), StudyPrior()
    is_first = np.array([1.0, 1.0, 0.0])

    d, log_person, log_touch = np.linspace(-5.0, 5.0, 51), np.linspace(-6.0, 3.0, 121), np.linspace(-2.0, 2.0, 81)
    difference, person, touch = (
        axis[..., None] for axis in np.meshgrid(d, np.exp(log_person), np.exp(log_touch), indexing="ij")
    )
    variance = person**2 + touch**2 / touches
    off = means - difference * is_first
    precision = (1.0 / variance).sum(-1)
    level = (off / variance).sum(-1) / precision
    squares = ((off - level[..., None]) ** 2 / variance).sum(-1)
    difference, person, touch = difference[..., 0], person[..., 0], touch[..., 0]
    log_density = -0.5 * (squares + np.log(variance).sum(-1) + np.log(precision)) + np.log(person)
    log_density += -4.0 * np.log(touch) - 0.45 / touch**2 + stats.norm.logpdf(np.log(touch / 0.7) / np.log(2.0))
    density = np.exp(log_density + stats.norm.logpdf(difference) + stats.t.logpdf(person / 0.5, 3))
    marginal = integrate.trapezoid(integrate.trapezoid(density, log_touch), log_person)
    marginal /= integrate.trapezoid(marginal, d)
    below = integrate.trapezoid(marginal[d < 0.1], d[d < 0.1])
    mean = integrate.trapezoid(marginal * d, d)
    grid = posterior_grid(sums, prior)
    assert float(grid.weight @ grid.mean) == pytest.approx(mean, abs=0.01)
    assert grid.cdf(0.0) == pytest.approx(below, abs=0.01)


def test_wider_priors_pull_less():
    sums = SufficientStatistics(np.full((1, 6), 40.0), np.array([[3.7, 3.9, 4.1, 4.5, 4.7, 4.9]]), np.array([80.0]), 3)
    found = bayes_fit(sums, ("trained", "untrained"))
    by_prior = {(p.effect_prior_sd, p.person_prior_scale): p for p in found.posteriors}
    assert by_prior[0.5, 0.5].ratio > by_prior[1.0, 0.5].ratio > by_prior[2.0, 0.5].ratio > np.exp(-0.8)
    assert "equal tails" in found.convention
    assert f"{found.posteriors[0].ratio:.2f} times" in found.sentence


def test_draws_follow_the_posterior():
    sums = SufficientStatistics(np.full((1, 6), 40.0), np.array([[3.7, 3.9, 4.1, 4.5, 4.7, 4.9]]), np.array([80.0]), 3)
    grid = posterior_grid(sums, StudyPrior())
    difference, person_sd, touch_sd = grid.draw(20_000, np.random.default_rng(1001))
    assert (difference < 0.0).mean() == pytest.approx(grid.cdf(0.0), abs=0.01)
    assert np.median(difference) == pytest.approx(grid.quantile(0.5), abs=0.02)
    assert np.median(person_sd) == pytest.approx(grid.person_sd_quantile(0.5), rel=0.05)
    assert np.median(touch_sd) == pytest.approx(np.sqrt(80.0 / 234.0), rel=0.02)
