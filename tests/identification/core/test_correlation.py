"""The integrated correlation time is the number of samples that repeat each other."""

import numpy as np
import pytest
from scipy.signal import lfilter

from exograv.identification.core.correlation import integrated_correlation

PERIOD_S = 0.04


def autoregressive(keep: float, samples: int, seed: int) -> np.ndarray:
    """Samples of an AR(1) process: each sample keeps a share of the previous one."""
    noise = np.random.default_rng(seed).standard_normal(samples)
    return np.asarray(lfilter([1.0], [1.0, -keep], noise))


@pytest.mark.parametrize("keep", [0.3, 0.6, 0.9])
def test_an_autoregressive_residual_has_its_textbook_time(keep: float):
    expected = PERIOD_S * (1 + keep) / (1 - keep)
    found = integrated_correlation(autoregressive(keep, 100_000, seed=0), PERIOD_S)
    assert found == pytest.approx(expected, rel=0.08)  # the sum stops at ρ = 0.05


def test_the_mean_of_an_autoregressive_residual_varies_as_the_time_says():
    keep, samples = 0.8, 2000
    means = [autoregressive(keep, samples, seed).mean() for seed in range(400)]
    variance = 1.0 / (1 - keep**2)
    repeats = integrated_correlation(autoregressive(keep, 100_000, seed=1), PERIOD_S) / PERIOD_S
    assert np.var(means) == pytest.approx(variance * repeats / samples, rel=0.2)


def test_white_noise_repeats_nothing():
    white = np.random.default_rng(0).standard_normal(20_000)
    assert integrated_correlation(white, PERIOD_S) == pytest.approx(PERIOD_S)


def test_an_offset_is_no_correlation():
    white = np.random.default_rng(0).standard_normal(20_000)
    assert integrated_correlation(white + 100.0, PERIOD_S) == pytest.approx(PERIOD_S)


def test_a_residual_of_nothing_counts_each_sample_once():
    assert integrated_correlation(np.zeros(100), PERIOD_S) == PERIOD_S
