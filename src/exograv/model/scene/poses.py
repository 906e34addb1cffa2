"""Poses of the bodies of a tree in numbers, without CasADi: a picture must not need the extra `control`."""

from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from exograv.model.tree import Frame, Matrix, Tree, Vector


class Pose(NamedTuple):
    """Pose of a frame in the base."""

    R: Matrix
    p: Vector

    def of(self, point: Vector) -> Vector:
        """Position in the base [m] of a point that is given in the frame [m]."""
        return self.R @ point + self.p

    def inverse_of(self, point: Vector) -> Vector:
        """Position in the frame [m] of a point that is given in the base [m]."""
        return self.R.T @ (point - self.p)


ORIGIN = Pose(np.eye(3), np.zeros(3))


def body_poses(tree: Tree, q: Float[np.ndarray, " joint"], root: Vector | None = None) -> list[Pose]:
    """Pose of each body in the base at joint positions `q`; `root`: origin of the tree in the base [m]."""
    base = ORIGIN if root is None else Pose(np.eye(3), root)
    poses: list[Pose] = []
    for joint, position in zip(tree.joints, q, strict=True):
        parent = poses[joint.parent] if joint.parent >= 0 else base
        R, p = parent.R @ joint.R_parent_joint, parent.of(joint.p_parent_joint)
        if joint.kind == "revolute":
            R = R @ rotation(joint.axis, position)
        else:
            p = p + R @ joint.axis * position
        poses.append(Pose(R, p))
    return poses


def frame_point(tree: Tree, poses: list[Pose], frame: Frame) -> Vector:
    """Origin of a frame in the base [m]."""
    return (poses[frame.body] if frame.body >= 0 else ORIGIN).of(frame.p_body_frame)


def rotation(axis: Vector, angle: float) -> Matrix:
    """Rotation matrix about a unit vector by `angle` [rad], by Rodrigues' formula."""
    x, y, z = axis
    K = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return np.eye(3) + np.sin(angle) * K + (1.0 - np.cos(angle)) * K @ K
