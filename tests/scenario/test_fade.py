"""A change of mode is a ramp: the desired torque has no step."""

import numpy as np
import pytest

from exograv import motion
from exograv.loop.mode_ramp import fade

STEP_NM = 0.05  # N·m per tick: friction and passive torque change by several N·m in a second.


@pytest.mark.parametrize("goal", [0.0, 1.0])
def test_torque_follows_a_change_of_mode_in_small_steps(put_on, goal: float):
    worn = put_on()
    worn.controller.mode.drive = 1.0 - goal
    # An arm that was just put in settles, and friction is returned along its way. This is no change of mode.
    dt = worn.pilot.rig.period_s
    worn.pilot.run(worn.controller, motion.hold(worn.pilot.q.copy(), 1.0, dt), "Settling")
    asked, step = [], worn.controller.step

    def watched(*arguments):
        asked.append(step(*arguments).copy())
        return asked[-1]

    worn.controller.step = watched
    worn.pilot._native = None  # the tick in C does not call `step`
    fade(worn.pilot, worn.controller, "drive", goal, worn.pilot.q.copy())
    assert worn.controller.mode.drive == goal
    assert np.abs(np.diff(asked[5:], axis=0)).max() < STEP_NM


def test_a_mode_that_is_there_takes_no_time(put_on):
    worn = put_on()
    fade(worn.pilot, worn.controller, "drive", worn.controller.mode.drive, worn.pilot.q.copy())
    assert not worn.pilot.tick_us
