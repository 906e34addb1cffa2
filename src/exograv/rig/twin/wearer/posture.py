"""Poses of an arm's bones, and the posture in which an unusual arm lies like a usual one."""

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float

from exograv.model.limb import FREEDOMS

from .skeleton import Bone, Skeleton, axis_of

Angles = Float[np.ndarray, " freedom"]
Matrix = Float[np.ndarray, "3 3"]
Vector = Float[np.ndarray, " 3"]

KEPT = 1e-6
"""Weight of the distance from the start of the search [-]:

a straight elbow leaves the upper arm's rotation undetermined.
"""

FASTENED = np.array([0.0, 0.0, 0.0, 0.5 * np.pi, 0.0, 0.0, 0.0])
"""Hanging arm with bent elbow, palm to the body, in which an arm's segments get their axes [rad]."""


@dataclass(frozen=True)
class BonePose:
    """Pose of a bone, relative to the shoulder centre of the hanging arm."""

    R: Matrix
    p: Vector
    """Origin of the bone [m]."""

    def of(self, point: Vector) -> Vector:
        """Position of a point of the bone [m]."""
        return self.p + self.R @ point


def bone_poses(skeleton: Skeleton, q: Angles) -> dict[str, BonePose]:
    """Poses of all bones at the posture `q` [rad], with the joints that follow, without the shoulder's shift."""
    values = dict(zip(skeleton.freedoms, q, strict=True))
    for coupling in skeleton.couplings:
        values[coupling.joint] = np.polyval(coupling.polynomial[::-1], values[coupling.freedom])
    poses: dict[str, BonePose] = {}
    for bone in skeleton.bones:
        parent = BonePose(np.eye(3), np.zeros(3)) if bone.parent is None else poses[bone.parent]
        R, p = parent.R, parent.of(bone.origin)
        for joint in bone.joints:
            axis, value = joint.axis / np.linalg.norm(joint.axis), float(values[joint.name])
            if joint.is_slide:
                p = p + R @ axis * value
                continue
            anchor = p + R @ joint.anchor
            R = R @ rotation(axis, value)
            p = anchor - R @ joint.anchor
        poses[bone.name] = BonePose(R, p)
    return poses


def hanging_points(skeleton: Skeleton) -> dict[str, Vector]:
    """Centres of shoulder, elbow and wrist while the arm hangs straight [m]."""
    poses = bone_poses(skeleton, np.zeros(len(skeleton.freedoms)))
    places = {"shoulder": skeleton.centres["upper_arm"], "elbow": skeleton.elbow, "wrist": skeleton.wrist}
    return {name: poses[bone].of(point) for name, (bone, point) in places.items()}


def usual_axes(skeleton: Skeleton, q: Angles) -> dict[str, Matrix]:
    """Axes of upper arm, forearm and hand of a usual arm at the posture `q` [rad]."""
    turns = [rotation(axis_of(name, skeleton.side), float(angle)) for name, angle in zip(FREEDOMS, q, strict=False)]
    upper_arm = turns[0] @ turns[1] @ turns[2]
    forearm = upper_arm @ turns[3]
    if len(q) == len(FREEDOMS):
        forearm = forearm @ turns[4]
        return {"upper_arm": upper_arm, "forearm": forearm, "hand": forearm @ turns[5] @ turns[6]}
    return {"upper_arm": upper_arm, "forearm": forearm}


def lying_like(skeleton: Skeleton, q: Angles) -> Angles:
    """Posture in which upper arm, forearm and a moving hand lie as those of a usual arm at `q` [rad].

    People put an arm into a machine in this way: the limbs lie along its links, with the joint angles that this needs.
    A forearm on an oblique elbow needs another rotation of the upper arm for that.
    """
    if skeleton.is_straight:
        return q
    from scipy.optimize import least_squares  # imported here: the import takes 0.1 s

    wanted = usual_axes(skeleton, q)

    def astray(angles: Angles) -> Float[np.ndarray, " residual"]:
        poses = bone_poses(skeleton, angles)
        shoulder, elbow, wrist = (
            poses[bone].of(point) for bone, point in (skeleton.centres["upper_arm"], skeleton.elbow, skeleton.wrist)
        )
        misses = [_along(shoulder, elbow) + wanted["upper_arm"][:, 2], _along(elbow, wrist) + wanted["forearm"][:, 2]]
        if "hand" in wanted:
            misses.append((poses[skeleton.held["hand"]].R @ skeleton.hand_axes - wanted["hand"]).ravel())
        return np.concatenate([*misses, KEPT * (angles - q)])

    return least_squares(astray, q, xtol=1e-14, ftol=1e-14, gtol=1e-14).x


def turned_to_lie(skeleton: Skeleton) -> Angles:
    """Angles by which each freedom is turned in the fastened cuffs beyond those of a usual arm there [rad].

    An oblique elbow needs another rotation of the upper arm. Software that takes the arm for a usual one while it is
    donned counts all later angles from there.
    """
    q = FASTENED[: len(skeleton.freedoms)]
    return lying_like(skeleton, q) - q


def fastened_parts(skeleton: Skeleton, segment: str) -> list[Bone]:
    """Bones of a segment as parts of one body, with their frames at its proximal centre, in its axes.

    The axes are those of a usual arm that lies like this one in the fastened cuffs. Software without a model of oblique
    joints uses these axes.
    """
    bones = [bone for bone in skeleton.bones if bone.segment == segment]
    if skeleton.is_straight:
        return [replace(bone, origin=origin) for bone, origin in skeleton.bones_of(segment)]
    q = FASTENED[: len(skeleton.freedoms)]
    poses, axes = bone_poses(skeleton, lying_like(skeleton, q)), usual_axes(skeleton, q)[segment]
    first, point = skeleton.centres[segment]
    centre = poses[first].of(point)
    parts = []
    for bone in bones:
        R = axes.T @ poses[bone.name].R
        origin = axes.T @ (poses[bone.name].p - centre)
        parts.append(replace(bone, origin=origin, com=R @ bone.com, inertia=R @ bone.inertia @ R.T))
    return parts


def _along(begin: Vector, end: Vector) -> Vector:
    return (end - begin) / np.linalg.norm(end - begin)


def rotation(axis: Vector, angle: float) -> Matrix:
    """Rotation by an angle [rad] about a unit axis."""
    x, y, z = axis
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return np.eye(3) + np.sin(angle) * cross + (1.0 - np.cos(angle)) * cross @ cross
