"""A ramp to new parameters is planned by its steepest part."""

import numpy as np
import pytest

from exograv.loop.arm_controller import steepest_change


def test_a_straight_ramp_changes_the_torque_by_the_difference_of_its_ends():
    assert steepest_change(np.zeros(2), np.array([1.0, -2.0]), np.array([2.0, -4.0])) == pytest.approx(4.0)


def test_a_curved_ramp_counts_at_its_steepest_end():
    # The torque s² has the slope 2 at the end of the ramp, and a mean slope of 1.
    assert steepest_change(np.zeros(1), np.array([0.25]), np.ones(1)) == pytest.approx(2.0)


def test_a_ramp_that_returns_to_its_torque_is_not_free():
    assert steepest_change(np.zeros(1), np.array([0.25]), np.zeros(1)) == pytest.approx(1.0)
