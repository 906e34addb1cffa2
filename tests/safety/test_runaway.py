"""A joint that is too fast gets no torque through its motor any more, and its own drive brakes it."""

import numpy as np
import pytest

from exograv.safety.envelope import Envelope
from exograv.safety.limits import Limits
from exograv.safety.stops import StopReason

DT = 1e-3
LIMITS = Limits(np.array([60.0, 30.0]), np.array([10.0, 4.0]))
RATE = LIMITS.torque_rate_max_Nm_per_s * DT
STILL = np.zeros(2)
TORQUE = np.array([12.0, -3.0])
BY_DRIVE = 2.0  # as a multiple of the damping of the soft descent
INERTIA = 0.25  # kg·m², of an elbow with its part of the machine


def settled() -> Envelope:
    envelope = Envelope(LIMITS, DT)
    for _ in range(100):
        envelope.limit(TORQUE, STILL, STILL)
    return envelope


@pytest.mark.parametrize("v", [np.array([0.0, 5.1]), np.array([0.0, -5.1])])
def test_a_joint_that_is_too_fast_is_left_to_its_drive_and_the_other_one_comes_down_softly(v: np.ndarray):
    envelope = settled()
    envelope.limit(TORQUE, STILL, v)
    assert envelope.stop is StopReason.TOO_FAST
    assert envelope.isolated == {1}
    np.testing.assert_array_equal(envelope.drive_damping, [0.0, BY_DRIVE * 4.0])
    descent = np.array([envelope.limit(TORQUE, STILL, v) for _ in range(1500)])
    assert not descent[30:, 1].any()  # 3 N·m are taken back within 20 ms
    assert descent[-1, 0] == pytest.approx(0.5 * TORQUE[0], rel=0.01)
    assert np.abs(np.diff(descent, axis=0)).max() <= RATE + 1e-9


def test_a_joint_that_runs_away_in_a_descent_is_left_to_its_drive_too_and_the_first_reason_stays():
    envelope = settled()
    envelope.trip(StopReason.STOP_PRESSED, isolate=(1,))
    envelope.limit(TORQUE, STILL, np.array([5.1, 9.0]))
    assert envelope.stop is StopReason.STOP_PRESSED
    np.testing.assert_array_equal(envelope.drive_damping, [BY_DRIVE * 10.0, 4.0])
    tau = [envelope.limit(TORQUE, STILL, np.array([5.1, 9.0])) for _ in range(100)][-1]
    assert tau[0] == 0.0
    assert tau[1] < -2.8


def test_after_a_reset_every_motor_is_used_again():
    envelope = settled()
    envelope.limit(TORQUE, STILL, np.array([5.1, 0.0]))
    envelope.reset()
    assert not envelope.drive_damping.any()
    tau = [envelope.limit(TORQUE, STILL, STILL) for _ in range(100)][-1]
    np.testing.assert_array_equal(tau, TORQUE)


@pytest.mark.parametrize("constant", [-1.0, -0.5, 0.0, 0.5, 1.0, 2.0])
@pytest.mark.parametrize("v", [4.1, -8.0])
def test_a_joint_past_the_trip_slows_down_for_any_torque_constant_of_its_motor(constant: float, v: float):
    envelope, speeds = settled(), [abs(v)]
    for _ in range(900):
        tau = envelope.limit(np.array([12.0, 0.0]), STILL, np.array([0.0, v]))
        # A motor with shorted phases brakes by the square of its constant. A dead motor does not brake; another part
        # must.
        brake = min(constant**2, 1.0) or 0.25
        v += DT * (constant * tau[1] - brake * envelope.drive_damping[1] * v) / INERTIA
        speeds.append(abs(v))
    assert max(speeds) < max(speeds[0], LIMITS.v_trip_rad_s) + 0.2
    assert envelope.stop is None or speeds[-1] < 0.05
