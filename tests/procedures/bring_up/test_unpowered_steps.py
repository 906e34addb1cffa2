"""A machine without torque may sink to where it hangs, and a motor that pushes it is found at once."""

from collections.abc import Callable

import numpy as np
import pytest

from exograv.procedures.bring_up.bench_machine import BenchMachine
from exograv.procedures.bring_up.unpowered_steps import SINKS_MAX_S, ZERO_S, zero_torque
from exograv.signals import JointState, TorqueSource

PERIOD_S = 0.01
RATED_A = 3.0


class Sinking:
    """Rig of two joints without torque, whose second joint moves as a function of the time since it is on."""

    joints, period_s = ("shoulder", "elbow"), PERIOD_S

    def __init__(self, way_deg: Callable[[float], float], current_A: float = 0.0):
        self.t, self._way_deg, self._current = 0.0, way_deg, current_A

    def enable(self) -> None:
        """Do nothing: the motion is a function of the time."""

    def write(self, _command: object) -> None:
        """Ignore the command, which is of no torque."""

    def status(self) -> tuple[()]:
        """Return no status."""
        return ()

    def read(self) -> JointState:
        """Advance the time by one period, and return the state."""
        self.t += PERIOD_S
        q = np.deg2rad([0.0, self._way_deg(self.t)])
        current, no_sensor = np.array([0.0, self._current]), np.full(2, np.nan)
        return JointState(self.t, 0, q, current, no_sensor, TorqueSource.CURRENT)


class SinkingBench(BenchMachine):
    """Bench machine with a rig of this test."""

    def __init__(self, rig: Sinking):
        self.rig, self.lock_step = rig, True  # pyright: ignore[reportAttributeAccessIssue]
        self.rated, self._zero = np.full(2, RATED_A), np.zeros(2)


def found(rig: Sinking) -> tuple[list[bool | None], float]:
    """Result of each step, and the time that the rig took [s]."""
    return [step.passed for step in zero_torque(SinkingBench(rig))], rig.t


def test_a_machine_that_sinks_to_where_it_hangs_and_stays_there_passes():
    passed, seconds = found(Sinking(lambda t: -8.0 * (1.0 - np.exp(-t / 0.7))))
    assert passed == [True, True]
    assert seconds < SINKS_MAX_S


@pytest.mark.parametrize("speed_deg_s", [3.0, 90.0])
def test_a_machine_that_does_not_stop_moving_fails(speed_deg_s: float):
    passed, seconds = found(Sinking(lambda t: speed_deg_s * t))
    assert passed == [True, False]
    assert seconds <= SINKS_MAX_S + 2.0 * ZERO_S


def test_a_motor_with_current_at_no_torque_is_not_waited_for():
    passed, seconds = found(Sinking(lambda t: 5.0 * t, current_A=0.2 * RATED_A))
    assert passed == [False, False]
    assert seconds <= ZERO_S + 2.0 * PERIOD_S
