"""Exported machines and arms agree in Pinocchio, MuJoCo and exograv: each tree alone, and closed by the cuffs."""

from dataclasses import replace
from pathlib import Path

import casadi as ca
import mujoco
import numpy as np
import pinocchio  # pyright: ignore[reportMissingImports] - found through a path file
import pytest

from exograv.dynamics.loop_torque import GRAVITY
from exograv.dynamics.parameters import ParameterLayout
from exograv.dynamics.rnea import rnea
from exograv.identification.core.arm_model import ArmModel
from exograv.identification.core.prior import prior
from exograv.model.assembly import Assembly
from exograv.model.kinematics import frame_pose
from exograv.model.loops import FIT, arm_poses
from exograv.model.mjcf_writer import Posture, mjcf_text
from exograv.model.personal import Personal, joint_positions, personal
from exograv.model.tree import Tree, inertial_parameters, is_physical
from exograv.model.urdf import read_urdf
from exograv.model.urdf_writer import roll_pitch_yaw, urdf_text
from exograv.procedures.calibration.nominal_machine import nominal_machine
from exograv.procedures.machine_tools.export_urdf import possible_links, springs_of

TORQUE_TOLERANCE = 1e-9  # N·m, of inverse dynamics of each tree
PLACE_TOLERANCE = 1e-12  # m and -: rounding
CLOSED_TOLERANCE = 5e-3  # N·m: a cuff's rotation residual is a sine in exograv and an angle in the exported hinges
WORN_FIT = {
    "shoulder_offset_x": 0.01,
    "shoulder_offset_y": -0.012,
    "shoulder_offset_z": 0.008,
    "upper_arm_lengthening": 0.006,
    "cuff_log_stiffness": 0.2,
    "cuff_log_rotational_stiffness": -0.3,
    "elbow_axis_x": 0.06,
    "elbow_axis_z": 0.04,
}
"""Fit without a shift of the shoulder's centre: MJCF holds it fixed, while in exograv it follows the arm. The elbow is
a little oblique: the two residuals of a cuff's rotation differ with the cube of the angle by which it is strained."""
SETTLE_STEPS = 6_000  # 3 s, half of them for the motion


@pytest.fixture(scope="module")
def worn(either_assembly: Assembly) -> tuple[Assembly, np.ndarray]:
    """Machine with all learned parameters of an arm."""
    machine = nominal_machine(either_assembly.description, either_assembly.exo.phi)
    x, _ = prior(either_assembly, machine)
    x = x.copy()
    x[ParameterLayout.of(either_assembly).fit] = [WORN_FIT.get(name, 0.0) for name in FIT]
    return either_assembly, x


@pytest.fixture(scope="module")
def person(worn: tuple[Assembly, np.ndarray]) -> Personal:
    assembly, x = worn
    layout = ParameterLayout.of(assembly)
    return personal(assembly, assembly.exo.phi, x[layout.phi], x[layout.fit])


def inverse_dynamics(tree: Tree, q: np.ndarray, v: np.ndarray, a: np.ndarray) -> np.ndarray:
    q_, v_, a_, phi, gravity = (ca.SX(ca.DM(one)) for one in (q, v, a, tree.phi.T, GRAVITY))
    return np.array(ca.evalf(rnea(tree, q_, v_, a_, phi, gravity))).ravel()


def motions(tree: Tree, count: int = 10) -> np.ndarray:
    return np.random.default_rng(0).uniform(-1.0, 1.0, (count, 3, len(tree.joints)))


@pytest.mark.parametrize("which", ["exo", "arm"])
def test_pinocchio_opens_the_urdf_and_has_the_same_torque(person: Personal, which: str):
    tree: Tree = getattr(person, which)
    model = pinocchio.buildModelFromXML(urdf_text(tree))
    assert tuple(model.names)[1:] == tree.joint_names
    data = model.createData()
    for q, v, a in motions(tree):
        np.testing.assert_allclose(
            pinocchio.rnea(model, data, q, v, a), inverse_dynamics(tree, q, v, a), atol=TORQUE_TOLERANCE
        )


PATH = {
    "glenohumeral_slope": 0.02,
    "glenohumeral_forward": 0.01,
    "glenohumeral_outward": -0.012,
    "glenohumeral_bend_up": 0.004,
    "glenohumeral_near_hanging_outward": 0.002,
    "glenohumeral_ahead_forward": -0.005,
    "glenohumeral_aside_up": 0.006,
}


@pytest.mark.parametrize("path", [PATH, {"glenohumeral_slope": -0.01}, {}], ids=["turned", "backward", "none"])
def test_the_exported_arm_has_the_shoulders_path(worn: tuple[Assembly, np.ndarray], path: dict[str, float]):
    assembly, x = worn
    layout, fit = ParameterLayout.of(assembly), np.array([(WORN_FIT | path).get(name, 0.0) for name in FIT])
    person = personal(assembly, assembly.exo.phi, x[layout.phi], fit)
    model = pinocchio.buildModelFromXML(urdf_text(person.arm))
    data, limb = model.createData(), assembly.arm.limbs[0]
    for q, v, a in motions(person.arm):
        np.testing.assert_allclose(
            pinocchio.rnea(model, data, q, v, a), inverse_dynamics(person.arm, q, v, a), atol=TORQUE_TOLERANCE
        )
    for z in np.random.default_rng(3).uniform(-1.0, 1.5, (5, assembly.n_freedoms)):
        q = np.delete(joint_positions(assembly, z, fit), limb.lengthening)
        pinocchio.framesForwardKinematics(model, data, q)
        ours = frame_pose(
            assembly.arm.tree, arm_poses(assembly, ca.SX(ca.DM(z)), ca.SX(ca.DM(fit))), limb.prefix + "wrist"
        )
        theirs = data.oMf[model.getFrameId(limb.prefix + "wrist")]
        np.testing.assert_allclose(theirs.rotation, np.array(ca.evalf(ours.R)), atol=PLACE_TOLERANCE)
        place = np.array(ca.evalf(ours.p)).ravel() - person.bases[limb.side]
        np.testing.assert_allclose(theirs.translation, place, atol=PLACE_TOLERANCE)


def test_our_own_reader_reads_the_machine_back(person: Personal, tmp_path: Path):
    (tmp_path / "exo.urdf").write_text(urdf_text(person.exo))
    again = read_urdf(tmp_path / "exo.urdf")
    assert again.joint_names == person.exo.joint_names
    np.testing.assert_allclose(again.phi, person.exo.phi, atol=1e-12)
    assert set(person.exo.frames) <= set(again.frames)


def loaded(worn: tuple[Assembly, np.ndarray], person: Personal, rotor: float = 0.0) -> mujoco.MjModel:
    assembly, x = worn
    shifts = {joint.name: 0.0 for limb in assembly.arm.limbs for joint in assembly.arm.tree.joints[limb.shifts]}
    description = assembly.description
    arm = joint_positions(assembly, description.arm_donning_posture, x[ParameterLayout.of(assembly).fit])
    positions = dict(zip(description.joints, description.donning_posture.tolist(), strict=True))
    positions |= dict(zip(assembly.arm.tree.joint_names, arm.tolist(), strict=True))
    text = mjcf_text(person, springs_of(assembly, x), np.full(assembly.n, rotor), GRAVITY, shifts, Posture(positions))
    return mujoco.MjModel.from_xml_string(text)


def test_mujoco_opens_both_and_each_tree_has_the_same_torque(worn: tuple[Assembly, np.ndarray], person: Personal):
    model = loaded(worn, person)
    model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_CONSTRAINT
    model.jnt_stiffness[:], model.dof_damping[:] = 0.0, 0.0
    data = mujoco.MjData(model)
    for tree in (person.exo, person.arm):
        columns = [model.joint(name).qposadr[0] for name in tree.joint_names]
        for q, v, a in motions(tree):
            data.qpos[:], data.qvel[:], data.qacc[:] = 0.0, 0.0, 0.0
            data.qpos[columns], data.qvel[columns], data.qacc[columns] = q, v, a
            mujoco.mj_inverse(model, data)
            # Nearly zero: the cuffs' bodies have a mass of 1 g; their weight is compensated, but not their inertia.
            np.testing.assert_allclose(
                data.qfrc_inverse[columns], inverse_dynamics(tree, q, v, a), atol=cuffs_inertia(tree, person)
            )


def cuffs_inertia(tree: Tree, person: Personal) -> float:
    """Torque from the inertia of cuffs: 1 g at 0.7 m, at speeds and accelerations of up to 4 for each joint [N·m]."""
    return TORQUE_TOLERANCE if tree is person.arm else 2e-3 * len(person.cuffs)


def test_the_cuffs_are_without_strain_where_they_were_fastened(worn: tuple[Assembly, np.ndarray], person: Personal):
    model = loaded(worn, person)
    data = mujoco.MjData(model)
    mujoco.mj_resetDataKeyframe(model, data, 0)
    mujoco.mj_forward(model, data)
    assert np.abs(data.efc_pos[: 6 * len(person.cuffs)]).max() < 1e-12


@pytest.mark.slow
def test_at_rest_in_its_cuffs_mujoco_asks_the_same_of_the_motors(worn: tuple[Assembly, np.ndarray], person: Personal):
    assembly, x = worn
    model = loaded(worn, person, rotor=0.25)
    model.jnt_stiffness[[model.joint(name).id for name in springs_of(assembly, x).stiffness]] = 0.0
    exo = [model.joint(name).qposadr[0] for name in person.exo.joint_names]
    ours = ArmModel(assembly, replace(nominal_machine(assembly.description, assembly.exo.phi), gravity=GRAVITY))
    lower, upper = assembly.description.workspace
    data = mujoco.MjData(model)
    for y in np.random.default_rng(2).uniform(lower, upper, (3, assembly.n)):
        mujoco.mj_resetDataKeyframe(model, data, 0)
        start = data.qpos[exo].copy()
        for step in range(SETTLE_STEPS):
            way = start + min(1.0, 2.0 * step / SETTLE_STEPS) * (y - start)
            data.qfrc_applied[exo] = 400.0 * (way - data.qpos[exo]) - 40.0 * data.qvel[exo]
            mujoco.mj_step(model, data)
        assert np.abs(data.qvel).max() < 1e-3
        expected, _ = ours.at_rest(data.qpos[exo].copy(), x)
        np.testing.assert_allclose(data.qfrc_applied[exo], expected, atol=CLOSED_TOLERANCE)


def test_a_link_that_no_body_can_be_keeps_what_gravity_sees():
    possible = inertial_parameters(2.0, np.array([0.0, 0.02, -0.1]), np.diag([0.02, 0.02, 0.004]))
    impossible = possible.copy()
    impossible[[4, 6, 9]] -= 0.05
    phi, changed = possible_links(np.array([possible, impossible]), np.array([possible, possible]), ("a", "b"))
    assert changed == ("b",)
    assert is_physical(phi[1])
    np.testing.assert_array_equal(phi[0], possible)
    np.testing.assert_allclose(phi[1, :4], impossible[:4], atol=1e-15)


@pytest.mark.parametrize("pitch", [0.3, np.pi / 2, -np.pi / 2, 1.5707])
def test_angles_of_any_rotation_give_it_back(pitch: float):
    R = pinocchio.rpy.rpyToMatrix(0.4, pitch, -1.1)
    np.testing.assert_allclose(pinocchio.rpy.rpyToMatrix(*roll_pitch_yaw(R)), R, atol=1e-9)
