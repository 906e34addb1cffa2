"""Kinematics of a tree: poses of bodies and frames, as CasADi expressions of the joint positions."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import repeat
from types import MappingProxyType

import casadi as ca
import numpy as np
from jaxtyping import Float

from exograv.spatial import Transform, rotation_about

from .tree import Tree


@dataclass(frozen=True)
class ObliqueHinge:
    """Axis of a turning joint as an expression, in place of the tree's axis.

    At the position `zero` the joint's frame is that of the tree's own axis; from there it turns about `axis`.
    """

    R_parent_zero: Float[np.ndarray, "3 3"]
    """Rotation of the joint's frame in its parent at the position `zero`."""

    axis: ca.SX
    """Unit vector (3,) in the joint's frame."""

    zero: float
    """Position of the joint at which both axes give the same pose [rad]."""


Hinges = Mapping[int, ObliqueHinge]
"""Oblique hinges by index of the joint."""

NO_HINGES: Hinges = MappingProxyType({})


def joint_axis(tree: Tree, i: int, hinges: Hinges = NO_HINGES) -> ca.SX:
    """Axis (3,) of a joint in its own frame, a unit vector."""
    return hinges[i].axis if i in hinges else ca.SX(ca.DM(tree.joints[i].axis))


def joint_transforms(tree: Tree, q: ca.SX, hinges: Hinges = NO_HINGES) -> list[Transform]:
    """Pose of each body in its parent, at joint positions `q` (joint,)."""
    transforms = []
    for i, joint in enumerate(tree.joints):
        axis, R0, p0 = ca.DM(joint.axis), ca.DM(joint.R_parent_joint), ca.DM(joint.p_parent_joint)
        hinge = hinges.get(i)
        if hinge is not None:
            R = ca.DM(hinge.R_parent_zero) @ rotation_about(hinge.axis, q[i] - hinge.zero)
            transforms.append(Transform(R, ca.SX(p0)))
        elif joint.kind == "revolute":
            transforms.append(Transform(R0 @ rotation_about(axis, q[i]), ca.SX(p0)))
        else:
            transforms.append(Transform(ca.SX(R0), p0 + R0 @ axis * q[i]))
    return transforms


def body_poses(
    tree: Tree, q: ca.SX, T_world_root: Sequence[Transform] | None = None, hinges: Hinges = NO_HINGES
) -> list[Transform]:
    """Pose of each body in the world, at joint positions `q` (joint,).

    `T_world_root`: pose of the tree's base for each joint on it, in their order; the world's origin if None.
    """
    roots = iter(T_world_root) if T_world_root is not None else repeat(identity())
    poses: list[Transform] = []
    for joint, T_parent_body in zip(tree.joints, joint_transforms(tree, q, hinges), strict=True):
        poses.append((poses[joint.parent] if joint.parent >= 0 else next(roots)) @ T_parent_body)
    return poses


def frame_pose(tree: Tree, poses: Sequence[Transform], name: str) -> Transform:
    """Pose of a named frame in the world; the base of its tree is the world's origin."""
    frame = tree.frame(name)
    body = poses[frame.body] if frame.body >= 0 else identity()
    return body @ constant(frame.R_body_frame, frame.p_body_frame)


def turning(R: ca.SX, z: ca.SX) -> ca.SX:
    """Angular velocity of a rotation R (3, 3) per rate of each entry of z (3, freedom), in the outer frame's axes."""
    by_z = ca.jacobian(ca.vec(R), z)
    turns = []
    for k in range(z.numel()):
        S = ca.reshape(by_z[:, k], 3, 3) @ R.T
        turns.append(ca.vertcat(S[2, 1], S[0, 2], S[1, 0]))
    return ca.horzcat(*turns)


def constant(R: np.ndarray, p: np.ndarray) -> Transform:
    """Pose that is constant, as an expression."""
    return Transform(ca.SX(ca.DM(R)), ca.SX(ca.DM(p)))


def identity() -> Transform:
    """Return the identity: no rotation and no displacement."""
    return constant(np.eye(3), np.zeros(3))
