"""Weak muscles never exceed their remaining strength, and lifting bends an elbow with a synergy."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from exograv.motion import hold
from exograv.rig.twin import Disturbances, draw_wearer
from exograv.rig.twin.behaviour.acting_wearer import usual_physiology
from exograv.rig.twin.behaviour.weakness import (
    ELBOW,
    Weakness,
    WeakWearer,
    drawn_weakness,
    involuntary,
    weak_physiology,
    weakened,
)

DT, STILL = 1e-3, np.zeros(4)


def pull(weakness: Weakness) -> np.ndarray:
    """Torque of a wearer who for a second wants to be 1 rad from where the arm is held."""
    person = WeakWearer(weakness, DT, np.random.default_rng(1000))
    person.attempt()
    person.want(hold(np.ones(4), DT, DT), np.zeros((1, 4)), 0.0)
    return np.array([person.step(k * DT, STILL, STILL) for k in range(1000)])


@pytest.mark.parametrize("strength", [0.02, 0.1, 0.5])
def test_without_noise_no_torque_is_beyond_what_is_left(strength: float):
    torques = pull(Weakness(np.full(4, strength), noise=0.0))
    assert (np.abs(torques) <= strength * usual_physiology(4).torque_max + 1e-12).all()


def test_an_attempt_mobilises_all_or_less():
    most = 0.02 * usual_physiology(4).torque_max
    peaks = []
    person = WeakWearer(Weakness(np.full(4, 0.02), noise=0.0, mobilised_sd=0.2), DT, np.random.default_rng(1000))
    person.want(hold(np.ones(4), DT, DT), np.zeros((1, 4)), 0.0)
    for k in range(200):
        person.attempt()
        peaks.append(float((person.step(k * DT, STILL, STILL) / most).max()))
    assert min(peaks) < 0.8 < max(peaks) <= 1.0 + 1e-12


@given(synergy=st.floats(0.0, 1.0), lift=st.floats(-50.0, 50.0))
def test_only_lifting_bends_the_elbow_and_never_with_more_than_it_has(synergy: float, lift: float):
    weakness = Weakness(np.full(4, 0.1), synergy)
    bent = involuntary(weakness, weak_physiology(weakness).torque_max, np.array([lift, 0.0, 0.0, 0.0]))
    assert 0.0 <= bent <= 0.1 * usual_physiology(4).torque_max[ELBOW]
    if lift <= 0.0 or synergy == 0.0:
        assert bent == 0.0


def test_freedoms_of_one_arm_differ_and_a_seed_is_a_person():
    one = drawn_weakness(0.1, 1000, 4)
    assert len(set(one.strength.tolist())) == 4
    np.testing.assert_array_equal(one.strength, drawn_weakness(0.1, 1000, 4).strength)
    assert (drawn_weakness(1.0, 1000, 4).strength <= 1.0).all()


def test_what_weak_muscles_do_unasked_is_weaker_too():
    usual = draw_wearer(Disturbances.at_level(2), 1000)
    weak = weakened(usual, drawn_weakness(0.1, 1000, 4))
    assert (weak.arms[0].unrest.bias_rms < 0.3 * usual.arms[0].unrest.bias_rms).all()
    assert (weak.arms[0].unrest.burst_share < 0.3 * usual.arms[0].unrest.burst_share).all()
    assert weak.passive.stiffness.tolist() == usual.passive.stiffness.tolist()
