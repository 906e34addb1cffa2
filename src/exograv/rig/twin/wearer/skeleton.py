"""Bones and joints of one true arm as it hangs straight, when every frame has x forward, y left, z up."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from jaxtyping import Float

from exograv.model.limb import FREEDOMS
from exograv.model.rig_settings import FREEDOMS_OF_ARM, HAND_APART, ArmKind, ArmSide

from .segments import Segment

Vector = Float[np.ndarray, " 3"]

GRIP_FRACTION = 0.36
"""Distance of the grip's centre beyond the wrist, as a fraction of the hand's length: the hand's centre of mass.

Source: de Leva (1996).
"""


@dataclass(frozen=True)
class BoneJoint:
    """Joint between a bone and its parent, zero as the arm hangs straight."""

    name: str
    """Name from `model.limb.FREEDOMS`, or another name if the joint follows a freedom."""

    axis: Vector
    """Axis in the bone's frame; its positive direction is that of the freedom."""

    anchor: Vector
    """Point on the axis, in the bone's frame [m]."""

    is_slide: bool = False


@dataclass(frozen=True)
class Bone:
    """Rigid part of an arm. Its frame is parallel to all others while the arm hangs straight."""

    name: str
    segment: str
    """Segment that the bone's mass belongs to: upper arm, forearm or hand."""

    parent: str | None
    """Name of the parent bone; `None` for the trunk."""

    origin: Vector
    """Origin in the parent's frame, or relative to the shoulder centre [m]."""

    mass: float
    """Mass of the body that moves with the bone [kg]."""

    com: Vector
    """Centre of mass in the bone's frame [m]."""

    inertia: Float[np.ndarray, "3 3"]
    """Inertia about the centre of mass [kg·m²]."""

    joints: tuple[BoneJoint, ...]


@dataclass(frozen=True)
class Coupling:
    """Joint coupled to a freedom: joint = polynomial of the freedom's angle, lowest power first, zero at zero."""

    joint: str
    freedom: str
    polynomial: Float[np.ndarray, " 5"]


@dataclass(frozen=True)
class Skeleton:
    """Bones of one arm of the simulated wearer, with its side and its kind."""

    side: ArmSide
    kind: ArmKind
    bones: tuple[Bone, ...]
    """Bones of the arm, a parent before its children."""

    lengths: Mapping[str, float]
    """Lengths between joint centres; for the hand, from wrist to fingertip [m]."""

    held: Mapping[str, str]
    """Bone that the cuff of a segment holds, by segment."""

    centres: Mapping[str, tuple[str, Vector]]
    """Proximal joint centre of each segment with a mass, in the frame of its first bone [m]."""

    wrist: tuple[str, Vector]
    """Centre of the wrist, in the frame of a bone [m]."""

    grip: tuple[str, Vector]
    """Point at which a weight hangs in the hand, in the frame of a bone [m]."""

    hand_axes: Float[np.ndarray, "3 3"] = field(default_factory=lambda: np.eye(3))
    """Axes of the hand in the frame of the bone that bears it, as columns; z points from the fingers to the wrist."""

    couplings: tuple[Coupling, ...] = ()
    follows_elevation: bool = True
    """True if the shoulder centre shifts with elevation. If a girdle of bones moves it, it has no such shift."""

    @property
    def freedoms(self) -> tuple[str, ...]:
        """Freedoms of the arm, in order."""
        return FREEDOMS[: FREEDOMS_OF_ARM[self.kind]]

    @property
    def shoulder_joints(self) -> tuple[BoneJoint, ...]:
        """Flexion, abduction and rotation, in their order along the chain to the elbow."""
        return tuple(joint for bone in self.bones for joint in bone.joints if joint.name in FREEDOMS[:3])

    def bone(self, name: str) -> Bone:
        """Return a bone by name."""
        return next(bone for bone in self.bones if bone.name == name)

    @cached_property
    def is_usual(self) -> bool:
        """True if shoulder angles are the usual ones: flexion, then abduction, then rotation, at right angles."""
        return all(
            joint.name == name and np.array_equal(joint.axis, axis_of(name, self.side))
            for joint, name in zip(self.shoulder_joints, FREEDOMS[:3], strict=True)
        )

    @property
    def is_straight(self) -> bool:
        """True if the arm is built like a usual arm: all axes in their places, elbow and wrist below the shoulder."""
        joints = [joint for bone in self.bones for joint in bone.joints]
        return (
            self.is_usual
            and not self.couplings
            and all(np.array_equal(joint.axis, axis_of(joint.name, self.side)) for joint in joints)
            and not any(
                place[:2].any() for place in (*(bone.origin for bone in self.bones), self.elbow[1], self.wrist[1])
            )
        )

    @property
    def elbow(self) -> tuple[str, Vector]:
        """Centre of the elbow, as in `centres`."""
        return self.centres["forearm"]

    @property
    def mid_forearm(self) -> tuple[str, Vector]:
        """Point half-way between elbow and wrist, as in `centres`, where a weight is strapped to the forearm."""
        bone, centre = self.elbow
        name, wrist = self.wrist
        while name != bone:
            above = self.bone(name)
            wrist, name = wrist + above.origin, above.parent or bone
        return bone, centre + 0.5 * (wrist - centre)

    def bones_of(self, segment: str) -> Iterator[tuple[Bone, Vector]]:
        """Yield the bones of a segment, with their places relative to the segment's proximal centre [m]."""
        first, centre = self.centres[segment]
        places = {first: -centre}
        for bone in self.bones:
            if bone.segment == segment:
                if bone.name not in places and bone.parent is not None:
                    places[bone.name] = places[bone.parent] + bone.origin
                yield bone, places[bone.name]


def drawn_skeleton(segments: Mapping[str, Segment], side: ArmSide, kind: ArmKind) -> Skeleton:
    """Return an arm of three segments whose joint axes meet in the joint centres at right angles."""
    upper_arm, forearm, hand = (segments[name] for name in ("upper_arm", "forearm", "hand"))
    moved, has_hand = FREEDOMS[: FREEDOMS_OF_ARM[kind]], kind in HAND_APART
    upper, lower, last = moved[:3], moved[3:5], moved[5:]
    grip = GRIP_FRACTION * hand.length
    zero = np.zeros(3)
    bones = (
        _bone("upper_arm", "upper_arm", None, zero, upper_arm, _joints(side, upper)),
        _bone("forearm", "forearm", "upper_arm", _below(upper_arm.length), forearm, _joints(side, lower)),
        _bone("hand", "hand" if has_hand else "forearm", "forearm", _below(forearm.length), hand, _joints(side, last)),
    )
    held = {name: name for name in segments}
    return Skeleton(
        side,
        kind,
        bones,
        lengths={name: segment.length for name, segment in segments.items()},
        held=held,
        centres={name: (name, zero) for name in dict.fromkeys(bone.segment for bone in bones)},
        wrist=("hand", zero),
        grip=("hand", _below(grip)) if has_hand else ("forearm", _below(forearm.length + grip)),
    )


def axis_of(freedom: str, side: ArmSide) -> Vector:
    """Axis of a freedom while the arm hangs straight and its palm faces the body, by the right-hand rule."""
    outward = 1.0 if side == "right" else -1.0
    axes = {
        "abduction": (-outward, 0.0, 0.0), "rotation": (0.0, 0.0, outward), "forearm_roll": (0.0, 0.0, outward),
        "wrist_flexion": (outward, 0.0, 0.0),
    }  # fmt: skip
    return np.array(axes.get(freedom, (0.0, -1.0, 0.0)))


def _joints(side: ArmSide, freedoms: tuple[str, ...]) -> tuple[BoneJoint, ...]:
    return tuple(BoneJoint(freedom, axis_of(freedom, side), np.zeros(3)) for freedom in freedoms)


def _bone(
    name: str, segment: str, parent: str | None, origin: Vector, body: Segment, joints: tuple[BoneJoint, ...]
) -> Bone:
    return Bone(name, segment, parent, origin, body.mass, body.com, body.inertia, joints)


def _below(length: float) -> Vector:
    return np.array([0.0, 0.0, -length])
