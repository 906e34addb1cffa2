"""Geometry of one arm of a machine at its zero posture: shoulder, elbow, and directions of the wearer's segments."""

from dataclasses import dataclass

import casadi as ca
import numpy as np
from jaxtyping import Float

from exograv.model.kinematics import body_poses
from exograv.model.tree import Matrix, Tree, Vector
from exograv.model.urdf_inference import ArmGuess

UPPER_ARM_M = 0.29
"""Upper arm assumed for a machine without shoulder joints: median of men and women (docs/explanation/arm.md)."""
ON_AXIS_M, FRAME_MIN_M = 0.01, 0.05
"""Distance from the elbow's axis below which a centre of mass, or a frame, does not show the forearm's direction."""
SNAP_COSINE = np.cos(np.deg2rad(25.0))
"""A centre of mass within 25° of the direction along or across the upper arm shows that direction: drives beside the
limb shift it."""


@dataclass(frozen=True)
class ArmGeometry:
    """Places and directions of one arm, in the frames of the bodies that carry them."""

    carrier: int
    """Body that carries the elbow's joint; -1 is the base."""
    shoulder: Vector
    elbow: Vector
    """Centres of shoulder and elbow in the carrier's frame [m]."""
    axis: Vector
    """Axis of the elbow in the carrier's frame."""
    upper_arm: Vector
    """Direction from shoulder to elbow in the carrier's frame."""

    elbow_body: int
    elbow_in_body: Vector
    """Centre of the elbow in the frame of the body behind it [m]."""
    forearm: Vector
    """Direction from elbow to hand in that frame."""
    axis_in_body: Vector


class Pose:
    """Numeric poses of the bodies at postures of the tree."""

    def __init__(self, tree: Tree):
        q = ca.SX.sym("q", len(tree.joints))
        columns = [part for pose in body_poses(tree, q) for part in (pose.R, pose.p)]
        self._poses = ca.Function("poses", [q], [ca.horzcat(*columns)])

    def __call__(self, q: Float[np.ndarray, " joint"], body: int) -> tuple[Matrix, Vector]:
        """Rotation and position [m] of a body in the base."""
        if body < 0:
            return np.eye(3), np.zeros(3)
        found = np.array(self._poses(q))[:, 4 * body : 4 * body + 4]
        return found[:, :3], found[:, 3]

    def many(
        self, q: Float[np.ndarray, "posture joint"], body: int
    ) -> tuple[Float[np.ndarray, "posture 3 3"], Float[np.ndarray, "posture 3"]]:
        """Rotations and positions [m] of a moving body at many postures."""
        found = np.array(self._poses.map(len(q))(q.T)).reshape(3, len(q), -1)[:, :, 4 * body : 4 * body + 4]
        return found[:, :, :3].transpose(1, 0, 2), found[:, :, 3].T


def arm_geometry(tree: Tree, arm: ArmGuess) -> ArmGeometry | None:
    """Return the geometry of an arm; None if its elbow or shoulder is not known."""
    places = [guess.place for guess in arm.places]
    if "elbow" not in places:
        return None
    e = arm.joints[places.index("elbow")]
    joint, poses, zero = tree.joints[e], Pose(tree), np.zeros(len(tree.joints))
    R, origin = joint.R_parent_joint, joint.p_parent_joint
    axis, forearm_in_body = R @ joint.axis, _beyond(tree, e, arm)
    if forearm_in_body is None:
        return None
    if arm.meeting is not None:
        R_carrier, p_carrier = poses(zero, joint.parent)
        shoulder = R_carrier.T @ (arm.meeting - p_carrier)
        elbow = origin + axis * (axis @ (shoulder - origin))
    elif places[0] == "elbow":
        # The machine has no shoulder: the arm is taken as straight where the elbow's angle is zero.
        elbow, shoulder = origin, origin - UPPER_ARM_M * _nearest_axis(R @ forearm_in_body)
    else:
        return None
    length = float(np.linalg.norm(elbow - shoulder))
    if length < 0.1:
        return None
    upper_arm = (elbow - shoulder) / length
    forearm = _snapped(forearm_in_body, R.T @ upper_arm, joint.axis)
    return ArmGeometry(
        joint.parent, shoulder, elbow, axis, upper_arm, e, R.T @ (elbow - origin), forearm, joint.axis
    )  # fmt: skip


def _beyond(tree: Tree, e: int, arm: ArmGuess) -> Vector | None:
    """Direction of the forearm in the elbow's body, across the elbow's axis.

    It points to the centre of everything beyond the elbow. If that lies on the axis, as in files with placeholders for
    inertias, it points to the farthest frame.
    """
    joint, poses, zero = tree.joints[e], Pose(tree), np.zeros(len(tree.joints))
    R_e, p_e = poses(zero, e)
    moved = [i for i in arm.joints if i >= e]
    centre = sum(
        (poses(zero, i)[0] @ tree.phi[i, 1:4] + tree.phi[i, 0] * poses(zero, i)[1] for i in moved), np.zeros(3)
    )
    frames = [frame for frame in tree.frames.values() if frame.body in moved]
    places = [poses(zero, frame.body)[0] @ frame.p_body_frame + poses(zero, frame.body)[1] for frame in frames]
    away = [R_e.T @ (place - p_e) for place in (centre / tree.phi[moved, 0].sum(), *places)]
    away = [one - joint.axis * (joint.axis @ one) for one in away]
    if np.linalg.norm(away[0]) >= ON_AXIS_M:
        return away[0] / np.linalg.norm(away[0])
    farthest = max(away, key=lambda one: float(np.linalg.norm(one)))
    length = float(np.linalg.norm(farthest))
    return None if length < FRAME_MIN_M else farthest / length


def _nearest_axis(direction: Vector) -> Vector:
    """Axis of the frame within 25° of a direction, or the direction."""
    k = int(np.argmax(np.abs(direction)))
    nearest = np.sign(direction[k]) * np.eye(3)[k]
    return nearest if nearest @ direction > SNAP_COSINE else direction


def _snapped(direction: Vector, along: Vector, axis: Vector) -> Vector:
    """Direction along or across the upper arm within 25° of a direction, or the direction."""
    across = np.cross(axis, along)
    candidates = (along, -along, across, -across)
    return next((one for one in candidates if one @ direction > SNAP_COSINE), direction)
