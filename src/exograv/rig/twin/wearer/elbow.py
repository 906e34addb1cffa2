"""Elbow of a drawn arm: carrying angle, axis out of place, and a forearm that lies off its frame.

With a carrying angle the hinge of the elbow is oblique to both bones by half of it, so that the forearm deviates
outwards in extension and lies on the upper arm in full flexion. Measured carrying angles fall in this way.

Source: 11.6 ± 3.2° (men) and 16.7 ± 2.6° (women) in extension, about −1.7° at the end of flexion, by electromagnetic
tracking: Ergonomics 48:1645 (2005), abstract.
"""

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float

from exograv.model.rig_settings import ArmSide
from exograv.rig.twin.disturbances.levels import Disturbances
from exograv.rig.twin.disturbances.streams import stream

from .posture import rotation
from .regressions import Sex
from .skeleton import Bone, BoneJoint, Skeleton, axis_of

CARRYING_ANGLE_DEG = (0.0, 25.0)
"""Range of carrying angles; a drawn angle outside is set to the nearer end [°]."""

FORWARD, UPWARD = np.array([1.0, 0.0, 0.0]), np.array([0.0, 0.0, 1.0])


@dataclass(frozen=True)
class ElbowForm:
    """Deviation of an elbow and its forearm from a hinge at right angles to two bones in line."""

    carrying_angle: float
    """Angle by which the extended forearm deviates outwards from the upper arm's line [rad]."""

    axis_turn: Float[np.ndarray, " 2"]
    """Further turn of the elbow's axis, about the forward axis and about the upper arm [rad]."""

    forearm_turn: Float[np.ndarray, " 2"]
    """Further turn of the forearm, about the forward axis and about the usual axis of the elbow [rad]."""

    @property
    def is_usual(self) -> bool:
        """True if the elbow deviates in nothing."""
        return not any([self.carrying_angle, *self.axis_turn, *self.forearm_turn])


def draw_elbow(disturbances: Disturbances, seed: int, owner: str, sex: Sex) -> ElbowForm:
    """Draw the elbow of one arm. Both arms of a person have the same carrying angle."""
    mean, sd = (_degrees(disturbances, "carrying_angle", f"{sex}_{kind}_deg") for kind in ("mean", "sd"))
    drawn = mean + sd * float(stream(seed, "wearer", "carrying_angle").standard_normal())
    turns = stream(seed, owner, "elbow_axis").standard_normal((2, 2))
    axis_sd, forearm_sd = (_degrees(disturbances, "elbow_axis", f"{what}_sd_deg") for what in ("axis", "forearm"))
    return ElbowForm(
        float(np.deg2rad(np.clip(drawn, *CARRYING_ANGLE_DEG))),
        np.deg2rad(axis_sd * turns[0]),
        np.deg2rad(forearm_sd * turns[1]),
    )


def with_elbow(skeleton: Skeleton, elbow: ElbowForm) -> Skeleton:
    """Return a drawn arm with this elbow; the arm itself if the elbow is the usual one."""
    if elbow.is_usual:
        return skeleton
    outwards = outward_sign(skeleton.side) * elbow.carrying_angle
    usual = axis_of("elbow", skeleton.side)
    axis = rotation(FORWARD, elbow.axis_turn[0]) @ rotation(UPWARD, elbow.axis_turn[1])
    axis = axis @ rotation(FORWARD, 0.5 * outwards) @ usual
    R = rotation(usual, elbow.forearm_turn[1]) @ rotation(FORWARD, elbow.forearm_turn[0] + outwards)
    turned = {bone.name for bone in skeleton.bones if bone.parent is not None}
    (grip_bone, grip), (wrist_bone, wrist) = skeleton.grip, skeleton.wrist
    return replace(
        skeleton,
        bones=tuple(_turned(bone, R, axis, turned) for bone in skeleton.bones),
        grip=(grip_bone, R @ grip),
        wrist=(wrist_bone, R @ wrist),
        hand_axes=R,
    )


def outward_sign(side: ArmSide) -> float:
    """Sign of a turn about the forward axis that moves a hanging arm away from the body."""
    return -1.0 if side == "right" else 1.0


def _turned(bone: Bone, R: Float[np.ndarray, "3 3"], axis: Float[np.ndarray, " 3"], turned: set[str]) -> Bone:
    """Return a bone with the part below the elbow turned by `R`. The elbow's own place stays, and its axis is given."""
    if bone.name not in turned:
        return bone
    return replace(
        bone,
        origin=R @ bone.origin if bone.parent in turned else bone.origin,
        com=R @ bone.com,
        inertia=R @ bone.inertia @ R.T,
        joints=tuple(_joint(joint, R, axis) for joint in bone.joints),
    )


def _joint(joint: BoneJoint, R: Float[np.ndarray, "3 3"], axis: Float[np.ndarray, " 3"]) -> BoneJoint:
    return replace(joint, axis=axis if joint.name == "elbow" else R @ joint.axis, anchor=R @ joint.anchor)


def _degrees(disturbances: Disturbances, row: str, column: str) -> float:
    value = disturbances.value(row, column)
    if isinstance(value, tuple):
        raise TypeError(f"{row}.{column} is a range {value}; it is one number.")
    return value
