"""An entry leaves a delay line after as many steps as the line is long, and no entry is lost."""

import casadi as ca
import pytest

from exograv.rig.twin.machine.delays import Delays, passed
from exograv.rig.twin.world.scene import TIMESTEP


@pytest.mark.parametrize("steps", [0, 1, 2, 5])
def test_an_entry_leaves_after_the_length_of_the_line(steps: int):
    line, left = ca.SX(ca.DM.zeros(2, steps)), []
    for k in range(1, 10):
        oldest, line = passed(line, ca.SX([k, -k]))
        left.append([float(value) for value in ca.DM(oldest).full().ravel()])
    assert line.shape == (2, steps)
    assert left == [[0.0, 0.0]] * steps + [[float(k), -float(k)] for k in range(1, 10 - steps)]


@pytest.mark.parametrize("steps", range(9))
def test_commands_and_measurements_share_the_delay_and_no_step_is_lost(steps: int):
    delays = Delays.of(steps * TIMESTEP)
    assert delays.to_motors + delays.to_computer == steps
    assert 0 <= delays.to_motors - delays.to_computer <= 1
