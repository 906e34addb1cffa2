"""The guard in a replay of another run expects the motors to follow the new commands."""

import numpy as np
import pytest

from exograv.loop.output_feedback import NoTorque, OutputFeedback
from exograv.loop.replay.columns import Columns, ReplayedDecisions
from exograv.loop.replay.guard_replay import GuardReplay
from exograv.recording.reader import read_recording
from exograv.safety.stops import StopReason

from .conftest import Flown

TICKS, MORE_NM = 300, 4.0


@pytest.mark.parametrize(("is_other_run", "cause"), [(True, None), (False, StopReason.TORQUE_WRONG)])
def test_in_another_run_the_motors_follow_what_they_are_told_this_time(
    flown: Flown, is_other_run: bool, cause: StopReason | None
):
    recording = read_recording(flown.path)
    columns, joints = Columns(recording.ticks[:TICKS]), len(recording.joints)
    actuators = flown.machine.actuators
    guarding = GuardReplay(flown.laboratory.description, actuators, 0.001, is_other_run=is_other_run)
    guarding.forget(actuators.torque(columns["current"][0]))
    again = ReplayedDecisions.of(TICKS, joints)
    asking = NoTorque(joints)
    control = OutputFeedback(joints, 0.001, asking)
    for k in range(TICKS):
        asking.tau_feedforward = columns["tau_commanded"][k] + MORE_NM
        guarding.take(k, columns, control, again)
    assert guarding.guard.envelope.stop is cause
    assert np.allclose(again.tau_commanded[-1] - columns["tau_commanded"][-1], MORE_NM) is is_other_run
