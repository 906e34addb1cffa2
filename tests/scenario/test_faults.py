"""The arm comes down softly after any fault in the loop, and the operator reads a sentence."""

import numpy as np
import pytest

from exograv import motion
from exograv.errors import RigError
from exograv.loop.arm_controller import ArmController
from exograv.safety.stops import StopReason
from exograv.signals import Reference

SWING_RAD_S = 0.5  # Remaining swing after the torque has faded: the arm hangs and settles.
FALL_RAD_S = 2.0  # A freely falling arm reaches 5 rad/s within half a second.


class Faulty:
    """Arm controller that fails after some ticks."""

    def __init__(self, controller: ArmController, good_ticks: int):
        self._controller, self._left = controller, good_ticks
        self.is_broken = False
        self.closure_slope, self.clearance = 0.0, 1.0

    @property
    def tau_feedforward(self) -> np.ndarray:
        return self._controller.tau_feedforward

    def step(self, q: np.ndarray, v: np.ndarray, reference: Reference) -> np.ndarray:
        self._left -= 1
        self.is_broken = self._left < 0
        return self._controller.step(q, v, reference)


class NotANumber(Faulty):
    def step(self, q: np.ndarray, v: np.ndarray, reference: Reference) -> np.ndarray:
        tau = super().step(q, v, reference)
        return np.where([False, True, False, False], np.nan, tau) if self.is_broken else tau


class NotClosed(Faulty):
    def step(self, q: np.ndarray, v: np.ndarray, reference: Reference) -> np.ndarray:
        tau = super().step(q, v, reference)
        self.closure_slope = 1.0 if self.is_broken else 0.0
        return tau


class ClosureNotANumber(Faulty):
    def step(self, q: np.ndarray, v: np.ndarray, reference: Reference) -> np.ndarray:
        tau = super().step(q, v, reference)
        self.closure_slope = np.nan if self.is_broken else 0.0
        return tau


FAULTS = [
    (NotANumber, StopReason.NOT_FINITE),
    (NotClosed, StopReason.MODEL_LOST),
    (ClosureNotANumber, StopReason.MODEL_LOST),
]


@pytest.mark.parametrize(("kind", "reason"), FAULTS)
def test_a_fault_lets_the_arm_down_softly_and_is_told_in_a_sentence(put_on, kind: type[Faulty], reason: StopReason):
    worn = put_on()
    speeds, torques = [], []
    write = worn.twin.write

    def watched(command):
        write(command)
        torques.append(command.tau.copy())
        speeds.append(np.abs(worn.twin.truth.v).max())

    worn.twin.write = watched
    raised = np.deg2rad([60.0, 20.0, 0.0, 80.0])
    worn.controller.mode.drive = 1.0
    path = motion.go_to(worn.pilot.q, raised, 0.8, worn.twin.period_s)
    fault = kind(worn.controller, good_ticks=len(path))
    hold = motion.hold(raised, 1.0, worn.twin.period_s)
    with pytest.raises(RigError, match=reason.value):
        worn.pilot.run(fault, motion.joined([path, hold]), "Raising the arm")
    assert worn.pilot.envelope.stop is reason
    assert np.isfinite(torques).all()
    assert np.abs(np.diff(torques, axis=0)).max() <= 0.150 + 1e-9  # N·m per tick.
    assert max(speeds[len(path) :]) < FALL_RAD_S
    assert worn.twin.truth.q[0] < 0.5 * raised[0]  # The arm is down.
    assert speeds[-1] < SWING_RAD_S


def test_after_a_stop_nothing_but_a_reset_brings_torque_back(put_on):
    worn = put_on()
    hold = motion.hold(worn.pilot.q, 0.1, worn.twin.period_s)
    worn.pilot.envelope.trip(StopReason.MODEL_LOST)
    for _ in range(2):
        with pytest.raises(RigError):
            worn.pilot.run(worn.controller, hold, "Again")
    assert np.abs(worn.pilot.envelope.limit(np.full(4, 10.0), np.zeros(4), np.zeros(4))).max() < 1e-9
