"""Torque of a wrench at a frame: its virtual work, and the weight of a mass at the same frame."""

from collections.abc import Callable

import casadi as ca
import numpy as np
import pytest

from exograv.dynamics.frame_wrench import frame_torque
from exograv.dynamics.loop_torque import GRAVITY
from exograv.dynamics.rnea import rnea
from exograv.model.assembly import read_exoskeleton
from exograv.model.description import load_rig
from exograv.model.kinematics import body_poses, frame_pose
from exograv.model.tree import Tree, inertial_parameters

RIGS = "recupera_like", "recupera_like_7"
STEP_RAD = 1e-6


def tree_and_mount(rig: str) -> tuple[Tree, str]:
    description = load_rig(rig)
    return read_exoskeleton(description), description.calibration.mount


def pose_of(tree: Tree, mount: str) -> Callable[[np.ndarray], np.ndarray]:
    """Return the function from positions to the pose of a frame as a matrix (4, 4)."""
    q = ca.SX.sym("q", len(tree.joints))
    T = frame_pose(tree, body_poses(tree, q), mount)
    function = ca.Function("pose", [q], [T.R, T.p])

    def pose(at: np.ndarray) -> np.ndarray:
        R, p = function(at)
        return np.vstack([np.hstack([np.array(R), np.array(p)]), [0.0, 0.0, 0.0, 1.0]])

    return pose


def torque_of(tree: Tree, mount: str, q: np.ndarray, wrench: np.ndarray) -> np.ndarray:
    at, w = ca.SX.sym("q", len(tree.joints)), ca.SX.sym("w", 6)
    return np.array(ca.Function("torque", [at, w], [frame_torque(tree, at, mount, w)])(q, wrench)).ravel()


@pytest.mark.parametrize("rig", RIGS)
def test_work_of_a_wrench_is_that_of_the_joint_torques(rig: str):
    tree, mount = tree_and_mount(rig)
    rng = np.random.default_rng(0)
    q, wrench = rng.uniform(-0.8, 0.8, len(tree.joints)), rng.normal(0.0, 10.0, 6)
    pose, tau = pose_of(tree, mount), torque_of(tree, mount, q, wrench)
    for joint, step in enumerate(STEP_RAD * np.eye(len(q))):
        turn = np.linalg.inv(pose(q)) @ (pose(q + step) - pose(q - step)) / (2.0 * STEP_RAD)
        moved, turned = turn[:3, 3], np.array([turn[2, 1], turn[0, 2], turn[1, 0]])
        assert tau[joint] == pytest.approx(wrench[:3] @ moved + wrench[3:] @ turned, abs=1e-6)


@pytest.mark.parametrize("rig", RIGS)
def test_a_force_that_carries_a_mass_takes_its_weight_from_the_motors(rig: str):
    tree, mount = tree_and_mount(rig)
    frame, n = tree.frame(mount), len(tree.joints)
    q = np.random.default_rng(1).uniform(-0.8, 0.8, n)
    at, v = ca.SX.sym("q", n), ca.SX.zeros(n)
    phi = np.zeros((10, n))
    phi[:, frame.body] = inertial_parameters(2.0, frame.p_body_frame, np.zeros((3, 3)))
    weight = ca.Function("weight", [at], [rnea(tree, at, v, v, ca.SX(ca.DM(phi)), ca.SX(ca.DM(GRAVITY)))])
    carrying = np.r_[pose_of(tree, mount)(q)[:3, :3].T @ (-2.0 * GRAVITY), np.zeros(3)]
    np.testing.assert_allclose(torque_of(tree, mount, q, carrying), np.array(weight(q)).ravel(), atol=1e-9)
