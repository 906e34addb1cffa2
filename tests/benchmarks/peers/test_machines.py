"""The machines of the tasks are those that their rows name."""

import numpy as np
import pytest

from exograv.control.tick import SLOPE_MAX
from exograv.kernel import virtual_machine
from exograv.model.tree import is_physical
from peers import plan
from peers.tasks import machines
from peers.tasks.arm_tasks import machine_and_assembly

MISALIGNED = 1e-3  # rad: a thousand times the residual of the closure


@pytest.mark.parametrize("n", [4, 7])
def test_the_machine_has_as_many_joints_as_its_row_says(n: int):
    _, assembly = machine_and_assembly(n)
    assert assembly.n == n
    assert len(assembly.description.settings.actuators) == n
    assert all(is_physical(phi) for phi in assembly.exo.phi)


@pytest.mark.parametrize("n", [4, 7])
def test_the_aligned_arm_has_the_tables_mass_on_the_joints_of_the_machine(n: int):
    _, assembly = machine_and_assembly(n)
    arm = machines.aligned_arm(n)
    assert len(arm.joints) == n
    assert arm.phi[:, 0].sum() == pytest.approx(assembly.arm.phi[[0, 10]].sum())


def test_the_forearm_cuff_of_the_larger_machine_is_where_it_was_and_moves_with_the_roll():
    small, large = (machine_and_assembly(n)[1].exo for n in (4, 7))
    frame = large.frames["forearm_cuff"]
    assert frame.body == machines.ROLL
    np.testing.assert_allclose(
        large.joints[frame.body].p_parent_joint + frame.p_body_frame, small.frames["forearm_cuff"].p_body_frame
    )


@pytest.mark.parametrize("n", [4, 28])
def test_the_chains_rotations_are_rotations_without_a_zero(n: int):
    for joint in machines.chain(n).joints:
        np.testing.assert_allclose(joint.R_parent_joint @ joint.R_parent_joint.T, np.eye(3), atol=1e-12)
        assert np.abs(joint.R_parent_joint).min() > 1e-3


def test_91_parameters_are_learned_of_seven_joints():
    assert plan.task("torque_gradient_7").function.size1_out("gradient") == 91


@pytest.mark.parametrize("name", ["tick_general_4", "tick_general_7"])
def test_the_general_tick_is_timed_with_closed_loops_that_are_misaligned(name: str):
    task = plan.task(name)
    tick = virtual_machine.compile(task.function)
    for state in task.states:
        for argument, buffer in tick.inputs.items():
            buffer[...] = state[argument]
        outputs = tick()
        assert np.abs(outputs["slope"]).max() < SLOPE_MAX
        assert np.abs(outputs["z"] - state["q"][:4]).max() > MISALIGNED
