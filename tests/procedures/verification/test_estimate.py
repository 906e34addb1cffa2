"""Estimate of the left over: separated from friction and muscles, and less certain for a restless person."""

import numpy as np
import pytest

from exograv.dynamics.parameters import ParameterLayout
from exograv.identification.core.interface import RESTLESS
from exograv.model.arm import held_weight
from exograv.procedures.verification.estimate import LeftOverEstimator

HIDDEN_KG = 0.4
"""Hidden mass in the hand [kg]. Flexion and elbow carry it, with levers over 0.2 m."""


@pytest.fixture(scope="module")
def estimator(model, arm, postures) -> LeftOverEstimator:
    return LeftOverEstimator(model, arm, postures)


@pytest.fixture(scope="module")
def heavier(model, arm) -> np.ndarray:
    """Return the true arm: a bottle in the hand that the estimator does not know."""
    x = arm.x.copy()
    x[ParameterLayout.of(model.assembly).phi] += held_weight(model.assembly.arm, HIDDEN_KG, at="hand")
    return x


@pytest.fixture(scope="module")
def truth(model, arm, heavier, postures) -> np.ndarray:
    """Left over because of the bottle, RMS over the postures (joint,) [N·m]."""
    own = model.again()
    off = [own.at_rest(q, heavier)[0] - own.at_rest(q, arm.x)[0] for q in postures]
    return np.sqrt(np.mean(np.square(off), axis=0))


def ends(found) -> np.ndarray:
    return found.rms[1:]


def test_an_error_that_the_identification_excludes_is_found_all_the_same(estimator, heard, heavier, truth):
    low, high = ends(estimator.estimate(heard(heavier, 1000)))
    carries = truth > 2 * HIDDEN_KG
    assert carries.sum() == 2
    assert (low <= truth)[carries].all()
    assert (truth <= high)[carries].all()
    assert (low > 0.5 * truth)[carries].all()


def test_friction_that_turns_with_the_motion_leaves_nothing_over(estimator, heard, arm):
    without = estimator.estimate(heard(arm.x, 1001))
    with_friction = estimator.estimate(heard(arm.x, 1001, turning=1.0))
    np.testing.assert_allclose(with_friction.beyond, without.beyond, atol=0.05)
    np.testing.assert_allclose(ends(with_friction), ends(without), atol=0.05)


def test_the_more_restless_a_person_the_wider_the_interval(estimator, heard, arm):
    calm, restless = (estimator.estimate(heard(arm.x, 1002, restless=size)) for size in (0.3, 4.0))
    assert (np.ptp(ends(calm), axis=0) < np.ptp(ends(restless), axis=0)).all()
    assert calm.noise_scale < RESTLESS < restless.noise_scale


def test_an_arm_that_is_known_exactly_is_not_said_to_be_off(estimator, heard, arm):
    low, high = ends(estimator.estimate(heard(arm.x, 1003, restless=0.3)))
    assert (low == 0.0).all()
    assert (high < 0.2).all()
