"""Verdict of a verification: it names the joints, claims no more than the interval, and does not judge muscles."""

import numpy as np
import pytest

from exograv.identification.core.interface import RESTLESS
from exograv.identification.core.left_over import REJECTED_MAX
from exograv.procedures.verification.estimate import LeftOver
from exograv.procedures.verification.verification import RESTLESS_TEXT, VerificationResult

JOINTS = ("flexion", "elbow")
TARGETS = np.array([0.2, 0.1])


def verified(
    low: list[float], high: list[float], noise_scale: float = 1.0, rejected: float = 0.0
) -> VerificationResult:
    at = np.zeros((12, 2))
    left_over = LeftOver(np.zeros((1, 12, 2)), at, at, noise_scale, rejected)
    middle = 0.5 * (np.array(low) + np.array(high))
    return VerificationResult(at, left_over, np.array([middle, low, high]), np.zeros(3), TARGETS, 100.0)


@pytest.mark.parametrize(
    ("low", "high", "said"),
    [
        ([0.05, 0.02], [0.15, 0.09], "Every joint is surely within its target."),
        ([0.05, 0.02], [0.15, 0.12], "No joint surely exceeds its target; elbow may exceed it."),
        ([0.25, 0.02], [0.45, 0.12], "The left over exceeds its target at flexion."),
    ],
)
def test_the_verdict_says_what_the_interval_says(low: list[float], high: list[float], said: str):
    assert verified(low, high).why(JOINTS).startswith(said)


@pytest.mark.parametrize(("noise_scale", "rejected"), [(1.1 * RESTLESS, 0.0), (1.0, 1.1 * REJECTED_MAX)])
def test_a_person_who_does_not_relax_is_told_whatever_the_figures(noise_scale: float, rejected: float):
    restless = verified([0.05, 0.02], [0.15, 0.09], noise_scale, rejected)
    assert not restless.is_relaxed
    assert restless.why(JOINTS) == RESTLESS_TEXT
