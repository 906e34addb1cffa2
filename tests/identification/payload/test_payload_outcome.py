"""The outcome of an identification of a payload agrees with the interval of its mass."""

import numpy as np
import pytest

from exograv.identification.core.interface import Estimate
from exograv.identification.payload.payload_outcome import PayloadOutcome, judge, mass_interval


def estimate(mass: float, sd: float | None, rejected: float = 0.0) -> Estimate:
    covariance = None if sd is None else np.diag([sd**2, *[1.0] * 9])
    return Estimate(10.0, np.array([mass, *[0.0] * 9]), covariance, rejected, 1.0)


@pytest.mark.parametrize(
    ("mass", "sd", "rejected", "ratio", "outcome"),
    [
        (2.0, 0.02, 0.0, 1.1, PayloadOutcome.FOUND),
        (2.0, 0.2, 0.0, 1.1, PayloadOutcome.COARSE),
        (0.1, 0.2, 0.0, 1.1, PayloadOutcome.NOTHING_THERE),
        (2.0, 0.02, 0.5, 1.1, PayloadOutcome.STRANGE),
        (2.0, 0.02, 0.0, 2.5, PayloadOutcome.STRANGE),
        (2.0, None, 0.0, 1.1, PayloadOutcome.NO_INTERVAL),
    ],
)
def test_each_outcome_has_its_case(
    mass: float, sd: float | None, rejected: float, ratio: float, outcome: PayloadOutcome
):
    result = estimate(mass, sd, rejected)
    assert judge(result, mass_interval(result, 0.0), ratio, is_fitted=True) is outcome


def test_a_method_that_did_not_fit_the_log_is_never_called_found():
    result = estimate(2.0, 0.02)
    assert judge(result, mass_interval(result, 0.0), 1.1, is_fitted=False) is PayloadOutcome.NOT_FITTED


def test_an_uncertain_gain_adds_to_the_interval_as_an_independent_error():
    low, high = mass_interval(estimate(2.0, 0.03), gain_sd=0.02) or (0.0, 0.0)
    np.testing.assert_allclose([low, high], 2.0 + 1.96 * 0.05 * np.array([-1, 1]), atol=1e-4)
