"""New parameters enter by a ramp with limited torque rate, and every mixture on the way is a possible arm."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from exograv.control.handover import RAMP_MIN_S, Handover, TORQUE_RATE_MAX_Nm_per_s
from exograv.model.anthropometry import Body
from exograv.model.arm import build_arm, held_weight
from exograv.model.tree import is_physical

DT = 1e-3
HALF_A_TICK = 0.5 / (RAMP_MIN_S / DT)  # share: a ramp is a whole number of ticks
ROWS = np.random.default_rng(0).normal(size=(4, 44))
"""Torque per parameter in one posture."""


def ramp(handover: Handover, seconds: float) -> np.ndarray:
    return np.array([handover.step().copy() for _ in range(round(seconds / DT))])


@given(size=st.floats(0.01, 10.0), seed=st.integers(0, 1000))
@settings(max_examples=25)
def test_torque_changes_by_five_newton_metres_a_second_at_most(size: float, seed: int):
    change = size * np.random.default_rng(seed).normal(size=44)
    torque_change = float(np.abs(ROWS @ change).max())
    handover = Handover(np.zeros(44), DT)
    handover.publish(change, torque_change)
    torque = ramp(handover, 0.5) @ ROWS.T
    rate = np.abs(np.diff(np.vstack([np.zeros(4), torque]), axis=0)).max() / DT
    assert rate <= TORQUE_RATE_MAX_Nm_per_s * (1 + HALF_A_TICK)


def test_the_ramp_ends_exactly_at_what_was_published():
    goal = np.random.default_rng(0).normal(size=44)
    handover = Handover(np.ones(44), DT)
    handover.publish(goal, 3.0)
    assert not np.array_equal(ramp(handover, 0.6 - 2 * DT)[-1], goal)
    np.testing.assert_allclose(ramp(handover, 3 * DT)[-1], goal, atol=1e-14)
    np.testing.assert_allclose(handover.step(), goal, atol=1e-14)


def test_a_second_publication_starts_where_the_first_had_come_to():
    handover = Handover(np.zeros(44), DT)
    handover.publish(np.ones(44), 1.0)
    before = ramp(handover, 0.1)[-1]
    handover.publish(-np.ones(44), 2.0)
    np.testing.assert_allclose(handover.step(), before, atol=2 * 1.5 / (0.4 / DT))


def test_what_is_published_later_changed_by_its_owner_is_not_followed():
    goal, start = np.ones(44), np.zeros(44)
    handover = Handover(start, DT)
    start[:] = 9.0
    handover.publish(goal, 0.0)
    goal[:] = 9.0
    np.testing.assert_allclose(ramp(handover, 0.3)[-1], 1.0)


def test_nothing_published_leaves_everything_in_force():
    handover = Handover(np.ones(44), DT)
    np.testing.assert_array_equal(ramp(handover, 0.1), 1.0)


@pytest.mark.parametrize("part", [slice(0, 10), slice(10, 20)])
def test_every_mixture_of_two_arms_is_an_arm(part: slice):
    light = build_arm(Body(1.55, 50.0, "female"), "right")
    heavy = build_arm(Body(1.9, 95.0, "male"), "right")
    start, goal = (np.concatenate([phi, np.zeros(24)]) for phi in (light.phi, heavy.phi + held_weight(heavy, 1.0)))
    handover = Handover(start, DT)
    handover.publish(goal, 5.0)
    assert all(is_physical(x[part]) for x in ramp(handover, 1.1))


def test_parameters_put_in_force_at_once_end_a_ramp():
    handover, goal = Handover(np.zeros(44), DT), np.full(44, 2.0)
    handover.publish(np.ones(44), 3.0)
    ramp(handover, 0.1)
    handover.force(goal)
    np.testing.assert_array_equal(ramp(handover, 0.1), np.tile(goal, (100, 1)))
