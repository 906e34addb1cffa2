"""The method is batch least squares without forgetting, and least squares weighted by age with forgetting."""

import numpy as np

from exograv.identification.baselines.rls import RecursiveLeastSquares
from exograv.identification.core.sample_pace import DESCENT_PERIOD_S

OFF = np.linspace(-1.0, 1.0, 11)


def run(setting, samples, memory_s: float) -> RecursiveLeastSquares:
    method = RecursiveLeastSquares(setting, memory_s, noise_factor=1.0)
    for sample in samples:
        method.update(sample)
    return method


def test_without_forgetting_it_is_batch_least_squares_with_the_prior(linear_setting, linear_stream, posterior):
    setting = linear_setting()
    samples = linear_stream(setting, OFF, noise_seed=0)
    mean, covariance = posterior(setting, samples, np.ones(len(samples)))
    estimate = run(setting, samples, np.inf).estimate()
    np.testing.assert_allclose(estimate.x, mean, atol=1e-8)
    assert estimate.covariance is not None
    np.testing.assert_allclose(estimate.covariance, covariance, atol=1e-8)


def test_a_sample_counts_by_its_age_and_so_does_the_prior(linear_setting, linear_stream, posterior):
    setting = linear_setting()
    samples = linear_stream(setting, OFF, noise_seed=0)
    keep = np.exp(-DESCENT_PERIOD_S / 0.4)
    weights = keep ** np.arange(len(samples))[::-1]
    mean, covariance = posterior(setting, samples, weights, prior_weight=keep ** len(samples))
    estimate = run(setting, samples, 0.4).estimate()
    np.testing.assert_allclose(estimate.x, mean, rtol=1e-5, atol=1e-6)
    np.testing.assert_allclose(estimate.sd**2, np.diag(covariance), rtol=1e-4)


def test_it_follows_an_arm_that_changes_sooner_than_one_that_remembers_all(linear_setting, linear_stream):
    setting = linear_setting()
    before, after = linear_stream(setting, OFF), linear_stream(setting, -OFF)
    for sample in after:
        sample.t += before[-1].t
    errors = []
    for memory_s in (0.2, np.inf):
        method = run(setting, before, memory_s)
        for sample in after[:60]:
            method.update(sample)
        tau, _ = setting.model.linearise(after[60], method.estimate().x)
        errors.append(np.abs(tau - after[60].tau).max())
    assert errors[0] < 0.1 * errors[1]
