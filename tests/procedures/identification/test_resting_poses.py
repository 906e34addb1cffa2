"""Resting poses: the arm is where it should be, and its averages are free of friction and noise."""

import casadi as ca
import numpy as np
import pytest

from exograv.errors import ConfigError
from exograv.identification.core.interface import Rest
from exograv.laboratory.preparation import Preparation
from exograv.laboratory.virtual_laboratory import VirtualLaboratory
from exograv.loop.arm_controller import ArmController
from exograv.loop.pilot import Pilot
from exograv.model.assembly import Assembly
from exograv.model.description import RigDescription, load_rig
from exograv.model.kinematics import body_poses, frame_pose
from exograv.procedures.calibration.nominal_machine import nominal_machine
from exograv.procedures.identification.estimator_session import table_guess
from exograv.procedures.identification.resting_poses import sensing, take_rests
from exograv.rig.twin import Disturbances, Examiner, Twin, draw_machine, draw_wearer
from exograv.signals import Command, JointState

POSTURE = np.array([0.6, 0.3, 0.2, 1.2])
SAG_RAD = 0.06  # rotation of a weakly held joint by 3 N·m of model error and friction
FRICTION_NM = 0.05  # a twentieth of the friction in each direction
CARRIED_NM = 5e-3  # of torques of 4 N·m: the mean of two postures half a degree apart; sensors are perfect at level 0


@pytest.fixture(scope="module")
def description() -> RigDescription:
    return load_rig("recupera_like")


@pytest.fixture(scope="module")
def rested(description: RigDescription) -> tuple[Rest, VirtualLaboratory, Pilot]:
    level = Disturbances.at_level(0)
    laboratory = VirtualLaboratory(description, draw_machine(description, level, 3), draw_wearer(level, 3))
    assembly = laboratory.assembly()
    machine = nominal_machine(description, assembly.exo.phi)
    twin = Twin(description, laboratory.machine, laboratory.wearer, 3)
    pilot = Preparation(laboratory, 3).pilot_of(twin, machine.actuators)
    controller = ArmController(assembly, machine, table_guess(assembly, machine), twin.period_s)
    controller.mode.drive = 1.0
    return take_rests(pilot, controller, POSTURE[None, :])[0], laboratory, pilot


@pytest.mark.slow
def test_the_arm_rests_where_it_was_asked_to(rested):
    rest, _, pilot = rested
    np.testing.assert_allclose(rest.q, POSTURE, atol=SAG_RAD)
    assert rest.seconds == pytest.approx(pilot.rig.read().t)


@pytest.mark.slow
def test_reached_from_both_sides_the_motors_torque_is_free_of_friction(rested):
    rest, laboratory, _ = rested
    examiner = Examiner(laboratory.description, laboratory.machine, laboratory.wearer)
    np.testing.assert_allclose(rest.tau, examiner.lock_torque(rest.q), atol=FRICTION_NM)


@pytest.mark.slow
def test_the_cuffs_are_felt_as_they_carry_the_arm(rested):
    rest, laboratory, _ = rested
    examiner = Examiner(laboratory.description, laboratory.machine, laboratory.wearer)
    assembly = laboratory.assembly()
    # With the machine locked, all torque of the arm on its joints comes through the cuffs.
    share = examiner.lock_torque(rest.q) - examiner.lock_torque(rest.q, arm=False)
    through = np.zeros(4)
    for cuff, wrench in zip(assembly.cuffs, rest.wrenches, strict=True):
        through += exo_torque_of(assembly, cuff.exo_frame, rest.q, wrench)
    np.testing.assert_allclose(through, share, atol=CARRIED_NM)


class Bare:
    """Machine without cuff sensors."""

    joints, period_s, t = ("one",), 0.001, 0.0

    def read(self) -> JointState:
        raise NotImplementedError

    def write(self, command: Command) -> None:
        raise NotImplementedError

    def __enter__(self) -> "Bare":
        return self

    def __exit__(self, kind, error, trace) -> None:
        pass


def test_a_machine_without_sensors_at_its_cuffs_is_refused():
    with pytest.raises(ConfigError, match="no force/torque sensors"):
        sensing(Bare())


def exo_torque_of(assembly: Assembly, frame: str, q: np.ndarray, wrench: np.ndarray) -> np.ndarray:
    """Torque (joint,) with which the machine's joints balance a wrench at one of its frames [N·m]."""
    y = ca.SX.sym("y", len(q))
    T = frame_pose(assembly.exo, body_poses(assembly.exo, y), frame)
    pose = ca.Function("pose", [y], [T.p, T.R])
    _, R = (np.array(value) for value in pose(q))
    torque = np.zeros(len(q))
    step = 1e-6
    for k, way in enumerate(step * np.eye(len(q))):
        (p_0, R_0), (p_1, R_1) = ([np.array(v) for v in pose(q + sign * way)] for sign in (-1.0, 1.0))
        turn = R_1 @ R_0.T
        angle = 0.5 * np.array([turn[2, 1] - turn[1, 2], turn[0, 2] - turn[2, 0], turn[1, 0] - turn[0, 1]])
        torque[k] = (R @ wrench[:3] @ (p_1 - p_0).ravel() + R @ wrench[3:] @ angle) / (2.0 * step)
    return torque
