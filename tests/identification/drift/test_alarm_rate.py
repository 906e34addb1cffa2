"""The false-alarm rate of the drift monitor's tests is the stated one or less, on noise as stated."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from exograv.identification.drift.alarm_rate import threshold_of, time_between_alarms, variance_rate

POISSON_SIGMA = 3.0
"""Standard deviations of a Poisson count by which a measured number of alarms may exceed the expected one [-]."""


@given(
    mean_s=st.floats(60.0, 1e8), allowance=st.floats(0.02, 3.0), sd=st.floats(0.02, 3.0), correlation_s=st.floats(1, 5)
)
def test_the_threshold_of_a_rate_has_this_rate(mean_s: float, allowance: float, sd: float, correlation_s: float):
    rate, k = variance_rate(np.array([sd]), correlation_s), np.array([allowance])
    again = time_between_alarms(threshold_of(mean_s, k, rate), k, rate)
    assert again[0] == pytest.approx(mean_s, rel=1e-6)


def alarms(sd: float, correlation_s: float, allowance: float, threshold: float, seconds: float, lanes: int) -> int:
    """Count the alarms of independent tests on Ornstein–Uhlenbeck noise. A test begins anew after its alarm."""
    generator, dt = np.random.default_rng(0), 0.04
    keeps = np.exp(-dt / correlation_s)
    noise, total, count = sd * generator.standard_normal(lanes), np.zeros(lanes), 0
    for _ in range(round(seconds / dt)):
        noise = keeps * noise + sd * np.sqrt(1.0 - keeps**2) * generator.standard_normal(lanes)
        total = np.maximum(total + dt * (noise - allowance), 0.0)
        beyond = total >= threshold
        count += int(beyond.sum())
        total[beyond] = 0.0
    return count


@pytest.mark.parametrize(("sd", "allowance"), [(0.3, 0.05), (0.3, 0.25), (1.2, 0.25)])
def test_correlated_noise_gives_no_more_alarms_than_stated(sd: float, allowance: float):
    mean_s, seconds, lanes = 100.0, 200.0, 500
    k = np.array([allowance])
    threshold = threshold_of(mean_s, k, variance_rate(np.array([sd]), 3.0))
    expected = seconds * lanes / mean_s
    assert alarms(sd, 3.0, allowance, float(threshold[0]), seconds, lanes) <= expected + POISSON_SIGMA * expected**0.5
