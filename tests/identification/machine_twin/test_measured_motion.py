"""Recordings tell that motors have encoders of their own only by positions that are no copies of the joints'."""

import numpy as np
import pytest

from exograv.identification.machine_twin.measured_motion import MeasuredMotion, has_motor_encoders

T = 0.001 * np.arange(500)
Q = np.sin(np.outer(T, [1.0, 0.7, 1.3, 0.9]))
LEAD = 1e-4 * np.cos(np.outer(T, [5.0, 6.0, 7.0, 8.0]))


def motion(q_motor: np.ndarray | None) -> MeasuredMotion:
    nothing = np.zeros_like(Q)
    return MeasuredMotion("made", T, Q, nothing, nothing, np.zeros((len(T), 1)), q_motor)


def without_last(q_motor: np.ndarray) -> np.ndarray:
    return np.hstack([q_motor[:, :-1], np.full((len(T), 1), np.nan)])


@pytest.mark.parametrize(
    "motors",
    [[None], [Q], [Q + 0.3 + 1e-15 * LEAD], [without_last(Q + LEAD)], []],
    ids=["no column", "copies", "copies with an offset", "one joint without", "no motion"],
)
def test_a_machine_without_positions_of_each_motor_has_no_encoders_on_them(motors: list[np.ndarray | None]):
    assert not has_motor_encoders([motion(one) for one in motors])


def test_one_recording_with_positions_of_the_motors_is_enough():
    assert has_motor_encoders([motion(None), motion(Q), motion(Q + LEAD)])


def test_each_joint_may_have_them_in_another_recording():
    first = np.hstack([np.full((len(T), 1), np.nan), (Q + LEAD)[:, 1:]])
    assert has_motor_encoders([motion(first), motion(without_last(Q + LEAD))])
