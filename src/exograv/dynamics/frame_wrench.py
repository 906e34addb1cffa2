"""Torque on the joints of a tree from a wrench at a frame, by virtual work."""

import casadi as ca

from exograv.model.kinematics import body_poses, frame_pose, turning
from exograv.model.tree import Tree


def frame_torque(tree: Tree, q: ca.SX, name: str, wrench: ca.SX) -> ca.SX:
    """Generalised forces (joint,) [N·m or N] with which a wrench at a frame drives the joints: JᵀW.

    `wrench` (6,) is force [N] and moment [N·m] about the origin of the frame `name`, in its axes, on the tree.
    """
    T = frame_pose(tree, body_poses(tree, q), name)
    force, moment = T.R @ wrench[:3], T.R @ wrench[3:]
    return ca.jacobian(T.p, q).T @ force + turning(T.R, q).T @ moment
