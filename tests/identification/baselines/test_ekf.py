"""The method is a Kalman filter on a linear model; a body in its state stays possible, and bursts are rejected."""

import numpy as np

from exograv.identification.baselines.ekf import LogCholeskyFilter
from exograv.identification.core.interface import Sample
from exograv.model.tree import is_physical

OFF = np.linspace(-1.0, 1.0, 11)


def run(setting, samples: list[Sample], drift: float = 0.0) -> LogCholeskyFilter:
    method = LogCholeskyFilter(setting, noise_factor=1.0, drift=drift)
    for sample in samples:
        method.update(sample)
    return method


def test_on_plain_numbers_it_is_the_kalman_filter(linear_setting, linear_stream, posterior):
    setting = linear_setting(has_body=False)
    samples = linear_stream(setting, 0.3 * OFF, noise_seed=1)
    mean, covariance = posterior(setting, samples, np.ones(len(samples)))
    estimate = run(setting, samples).estimate()
    np.testing.assert_allclose(estimate.x, mean, atol=1e-8)
    assert estimate.covariance is not None
    np.testing.assert_allclose(estimate.covariance, covariance, atol=1e-8)


def test_a_state_that_wanders_is_never_known_as_well(linear_setting, linear_stream):
    setting = linear_setting()
    samples = linear_stream(setting, 0.3 * OFF)
    still, wandering = run(setting, samples).estimate(), run(setting, samples, drift=0.1).estimate()
    assert (wandering.sd > still.sd).all()


def test_whatever_it_is_told_the_body_is_possible(linear_setting, linear_stream):
    setting = linear_setting()
    method = LogCholeskyFilter(setting, noise_factor=1.0, drift=0.0)
    for sample in linear_stream(setting, -20.0 * np.ones(11)):
        sample.tau = np.clip(sample.tau, -30.0, 30.0)
        method.update(sample)
        assert is_physical(method.estimate().x[:10])


def test_a_burst_is_left_out_and_counted(linear_setting, linear_stream):
    setting = linear_setting()
    samples = linear_stream(setting, 0.2 * OFF)
    calm = run(setting, samples[:50]).estimate().x
    method = run(setting, samples[:50])
    burst = samples[50]
    burst.tau = burst.tau + 50.0
    method.update(burst)
    np.testing.assert_array_equal(method.estimate().x, calm)
    assert method.estimate().rejected_share > 0.0
