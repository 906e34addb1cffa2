"""Controller, twin and Pinocchio read the same machine from one URDF, each with its own reader."""

from pathlib import Path

import mujoco
import numpy as np
import pinocchio  # pyright: ignore[reportMissingImports] - found through a path file
import pytest

from exograv.model.description import robots_folder
from exograv.model.tree import Tree, inertial_parameters
from exograv.model.urdf import read_urdf

PARITY = 1e-12  # kg, kg·m, m, -: the same numbers moved through a few products
MUJOCO_PARITY = 1e-10  # kg·m²: MuJoCo keeps inertias as principal moments and a quaternion
SEEDS = range(4)
ROBOTS = robots_folder()
MACHINES = sorted(str(path.relative_to(ROBOTS)) for path in ROBOTS.glob("*/*.urdf"))


@pytest.fixture(params=[*MACHINES, *SEEDS])
def text_and_tree(request: pytest.FixtureRequest, tmp_path: Path, make_random_urdf) -> tuple[str, Tree]:
    if isinstance(request.param, str):
        text = (ROBOTS / request.param).read_text(encoding="utf-8")
    else:
        text = make_random_urdf(request.param)
    path = tmp_path / "same.urdf"
    path.write_text(text, encoding="utf-8")
    return text, read_urdf(path)


def test_pinocchio_reads_the_same_inertial_parameters(text_and_tree, make_pinocchio):
    text, tree = text_and_tree
    oracle = make_pinocchio(text, tree.joint_names)
    for i, phi in enumerate(tree.phi):
        np.testing.assert_allclose(phi, oracle.body_phi(i), atol=PARITY)


def test_pinocchio_puts_joints_and_frames_in_the_same_places(text_and_tree, make_pinocchio):
    text, tree = text_and_tree
    oracle = make_pinocchio(text, tree.joint_names)
    for joint, own in zip(tree.joints, oracle.ids, strict=True):
        placement = oracle.model.jointPlacements[own]
        np.testing.assert_allclose(joint.R_parent_joint, placement.rotation, atol=PARITY)
        np.testing.assert_allclose(joint.p_parent_joint, placement.translation, atol=PARITY)
    for name, frame in tree.frames.items():
        if name == "base":
            continue
        placement = oracle.model.frames[oracle.model.getFrameId(name, pinocchio.FrameType.BODY)].placement
        np.testing.assert_allclose(frame.R_body_frame, placement.rotation, atol=PARITY)
        np.testing.assert_allclose(frame.p_body_frame, placement.translation, atol=PARITY)


def test_mujoco_reads_the_same_inertial_parameters(text_and_tree):
    text, tree = text_and_tree
    model = mujoco.MjModel.from_xml_string(text)
    for joint, phi in zip(tree.joints, tree.phi, strict=True):
        body = int(model.joint(joint.name).bodyid[0])
        R = np.empty(9)
        mujoco.mju_quat2Mat(R, model.body_iquat[body])
        R = R.reshape(3, 3)
        inertia = R @ np.diag(model.body_inertia[body]) @ R.T
        theirs = inertial_parameters(float(model.body_mass[body]), model.body_ipos[body], inertia)
        np.testing.assert_allclose(phi, theirs, atol=MUJOCO_PARITY)


def test_mujoco_puts_joints_and_axes_in_the_same_places(text_and_tree):
    text, tree = text_and_tree
    model = mujoco.MjModel.from_xml_string(text)
    for joint in tree.joints:
        own = model.joint(joint.name)
        body = int(own.bodyid[0])
        R = np.empty(9)
        mujoco.mju_quat2Mat(R, model.body_quat[body])
        np.testing.assert_allclose(joint.p_parent_joint, model.body_pos[body], atol=PARITY)
        np.testing.assert_allclose(joint.R_parent_joint, R.reshape(3, 3), atol=PARITY)
        np.testing.assert_allclose(joint.axis, own.axis, atol=PARITY)


def test_mujoco_and_pinocchio_read_the_same_limits(assembly, make_pinocchio):
    path = assembly.description.urdf_path
    text, tree = path.read_text(encoding="utf-8"), read_urdf(path)
    theirs = make_pinocchio(text, tree.joint_names).model
    model = mujoco.MjModel.from_xml_string(text)
    for i, joint in enumerate(tree.joints):
        assert (joint.lower, joint.upper) == (theirs.lowerPositionLimit[i], theirs.upperPositionLimit[i])
        assert (joint.effort, joint.velocity) == (theirs.effortLimit[i], theirs.velocityLimit[i])
        np.testing.assert_array_equal(model.joint(joint.name).range, [joint.lower, joint.upper])
