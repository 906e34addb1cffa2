"""Inference from a URDF: side of the arm, place of each joint, and meeting point of the shoulder axes."""

from collections.abc import Collection
from dataclasses import dataclass
from itertools import repeat

import casadi as ca
import numpy as np
from jaxtyping import Float

from exograv.options import Side

from .kinematics import body_poses
from .rig_settings import ArmSide, Place
from .tree import Tree

WORDS: dict[Place, tuple[str, ...]] = {
    "elbow": ("elbow", "elb"),
    "wrist": ("wrist", "forearm", "prona", "supina", "hand", "radial", "ulnar"),
    "shoulder": ("shoulder", "humer", "gleno", "upperarm", "upper_arm"),
}
"""Parts of names by place. The first place with a match counts, so that "forearm" belongs to the wrist."""
CUFF_WORDS = ("cuff", "strap", "brace", "orthosis", "handle", "interface")
PLACED = "exograv_"
"""Start of the names of links that `exograv rig new` adds; they replace others for the same purpose."""
MEET_M = 0.005
"""Largest distance of axes from a common point at which they count as meeting there [m]."""
NEAR_M = 0.05
"""Largest distance of the three shoulder axes from the point nearest to them at which this point is proposed as the
shoulder's centre [m]. Assumed: the links of a shoulder have this thickness."""
ELBOW_LEAST_M = 0.1
"""Least distance of the fourth axis from the point where the first three meet, at which it is the elbow's [m]: shorter
than any upper arm, and longer than the links of a shoulder. Assumed."""
SAME_M = 0.001
SHOULDER_AXES = 3

Point = Float[np.ndarray, " 3"]


@dataclass(frozen=True)
class Length:
    """Distance of a joint from its parent along one axis."""

    joint: str
    axis: str
    metres: float


@dataclass(frozen=True)
class PlaceGuess:
    """Place of a joint along the arm."""

    place: Place | None
    """None if neither name nor position of the joint tells."""

    reason: str


UNKNOWN = PlaceGuess(None, "")
ONLY_JOINT = PlaceGuess("elbow", "assumed: the name of the only joint does not tell")
"""Place of the only joint of a machine, if its name tells none: every kind of arm includes the elbow."""


@dataclass(frozen=True)
class ArmGuess:
    """Inferred part of the machine for one arm, from names and geometry."""

    side: ArmSide | None
    joints: tuple[int, ...]
    """Indices of the arm's moving joints."""

    meeting: Point | None
    """Meeting point of the shoulder's axes in the base frame [m]; None if they do not meet. With one axis only, its
    point nearest to the elbow. Of three axes that pass by each other, the point nearest to them, if the name of the
    fourth joint says that it is the elbow."""

    apart_m: float
    """Distance of the farthest axis from the meeting point [m]; zero if the axes meet."""

    shoulder_axes: int
    """Number of the shoulder's axes from which the meeting point is found."""

    shoulder_centre: str | None
    """Link that is fixed to the base at the shoulder centre; None if there is none."""

    cuffs: tuple[str, ...]
    """Links with names of cuffs, nearest to the shoulder first."""

    upper_arm: Length | None

    places: tuple[PlaceGuess, ...]
    """Place of each of the arm's joints."""

    @property
    def meets(self) -> str:
        """Description of the meeting point."""
        if self.shoulder_axes == 1:
            return "assumed on the axis of its only shoulder joint, beside the elbow"
        if self.apart_m:
            return f"assumed: the first three axes pass it at up to {1000.0 * self.apart_m:.0f} mm"
        return f"where {'its two shoulder axes' if self.shoulder_axes == 2 else 'the first three axes'} meet"

    @property
    def wrist_joints(self) -> int | None:
        """Number of joints beyond the elbow; None if the place of a joint is not known."""
        places = [guess.place for guess in self.places]
        return None if None in places else places.count("wrist")


def place_of(name: str) -> Place | None:
    """Place of a joint along the arm, from its name; None if the name does not tell."""
    lower = name.lower()
    return next((place for place, words in WORDS.items() if any(word in lower for word in words)), None)


def side_of(tree: Tree) -> Side | None:
    """Side of the machine, from the names of robot and joints; None if they do not tell."""
    names = [tree.name, *tree.joint_names, *tree.bodies]
    found: set[Side] = {side for name in names for side in sides_in(name)}
    return "both" if len(found) == 2 else next(iter(found), None)


def arms(tree: Tree, elbows: Collection[str] = ()) -> list[ArmGuess]:
    """Infer each arm; in a machine for both, the names of joints contain the side.

    The joints `elbows` are known as elbows, whatever their names tell.
    """
    if side_of(tree) != "both":
        return [_arm(tree, None, tuple(range(len(tree.joints))), elbows)]
    sides: tuple[ArmSide, ArmSide] = ("right", "left")
    found = []
    for side in sides:
        joints = tuple(i for i, name in enumerate(tree.joint_names) if side in sides_in(name))
        if joints:
            found.append(_arm(tree, side, joints, elbows))
    return found


def _arm(tree: Tree, side: ArmSide | None, joints: tuple[int, ...], elbows: Collection[str]) -> ArmGuess:
    poses = body_poses(tree, ca.SX.zeros(len(tree.joints)))
    axes = [np.array(ca.evalf(poses[i].R)) @ tree.joints[i].axis for i in joints]
    points = [np.array(ca.evalf(poses[i].p)).ravel() for i in joints]
    names = [tree.joints[i].name for i in joints]
    named: list[Place | None] = ["elbow" if name in elbows else place_of(name) for name in names]
    n = _shoulder_axes(named)
    is_named, is_far = _has_elbow_after_shoulder(named), False
    meeting, apart_m = _foot(axes[0], points[0], points[1]) if n == 1 else None, 0.0
    if n > 1:
        meeting, apart_m = _meeting_point(axes[:n], points[:n], NEAR_M if is_named else MEET_M)
        is_far = n == SHOULDER_AXES < len(names) and meeting is not None and _is_far(axes[n], points[n], meeting)
    centre = _placed_centre(tree, side) if meeting is None else _fixed_link(tree, meeting, side)
    begin = SHOULDER_AXES - 1 if apart_m else 0
    length = _upper_arm(tree, joints[begin:], named[begin])
    is_fourth = meeting is not None and length is not None and names.index(length.joint) == SHOULDER_AXES
    places = _places(named, is_fourth or is_named or is_far)
    return ArmGuess(side, joints, meeting, apart_m, n, centre, _cuffs(tree, side, joints), length, places)


def _has_elbow_after_shoulder(named: list[Place | None]) -> bool:
    """Return True if the fourth joint is named as the elbow, and no joint before it as something else."""
    places = named[: SHOULDER_AXES + 1]
    return len(places) > SHOULDER_AXES and places[-1] == "elbow" and set(places[:-1]) <= {None, "shoulder"}


def _is_far(axis: Point, on_axis: Point, meeting: Point) -> bool:
    """Return True if an axis is as far from the shoulder as that of an elbow."""
    return float(np.linalg.norm(_foot(axis, on_axis, meeting) - meeting)) >= ELBOW_LEAST_M


def _shoulder_axes(named: list[Place | None]) -> int:
    """Return the number of joints before the one that is named as the elbow, three at most; three if none is."""
    before = named[: named.index("elbow")] if "elbow" in named else None
    if before is not None and len(before) < SHOULDER_AXES and set(before) <= {"shoulder"}:
        return len(before)
    return SHOULDER_AXES if len(named) >= SHOULDER_AXES else 0


def _places(named: list[Place | None], has_elbow_fourth: bool) -> tuple[PlaceGuess, ...]:
    """Place of each joint by its name, otherwise by its position in a chain of shoulder, elbow and wrist."""
    if named == [None]:
        return (ONLY_JOINT,)
    by_position = _by_position(len(named)) if has_elbow_fourth else [None] * len(named)
    if any(one not in (None, other) for one, other in zip(named, by_position, strict=True)):
        by_position = [None] * len(named)  # This machine is built in another way.
    return tuple(_guess(one, other) for one, other in zip(named, by_position, strict=True))


def _guess(named: Place | None, by_position: Place | None) -> PlaceGuess:
    if named is not None:
        return PlaceGuess(named, "by its name")
    return UNKNOWN if by_position is None else PlaceGuess(by_position, "by its position")


def _by_position(joints: int) -> list[Place | None]:
    return [*repeat("shoulder", SHOULDER_AXES), "elbow", *repeat("wrist", joints - SHOULDER_AXES - 1)]


def _meeting_point(axes: list[Point], points: list[Point], most_m: float) -> tuple[Point | None, float]:
    """Point of least distance to all axes; None if an axis is farther than `most_m` [m].

    Also return the distance of the farthest axis [m]; zero if the axes meet.
    """
    across = [np.eye(3) - np.outer(axis, axis) for axis in axes]
    A, b = np.vstack(across), np.concatenate([P @ p for P, p in zip(across, points, strict=True)])
    found, _, rank, _ = np.linalg.lstsq(A, b, rcond=None)
    off = A @ found - b
    if rank == 3 and np.abs(off).max() < MEET_M:
        return found, 0.0
    apart_m = float(np.linalg.norm(off.reshape(-1, 3), axis=1).max())
    return (found, apart_m) if rank == 3 and apart_m < most_m else (None, 0.0)


def _foot(axis: Point, on_axis: Point, point: Point) -> Point:
    """Return the point of an axis that is nearest to a point."""
    return on_axis + axis * (axis @ (point - on_axis))


def _fixed_link(tree: Tree, point: Point, side: ArmSide | None) -> str | None:
    near = [
        name
        for name, frame in tree.frames.items()
        if frame.body < 0 and np.linalg.norm(frame.p_body_frame - point) < MEET_M and _fits(name, side)
    ]
    return near[0] if near else None


def _placed_centre(tree: Tree, side: ArmSide | None) -> str | None:
    """Shoulder centre that `exograv rig new` has added to a machine without shoulder joints."""
    name = f"{PLACED}{side}_shoulder_centre" if side else f"{PLACED}shoulder_centre"
    return name if name in tree.frames else None


def _cuffs(tree: Tree, side: ArmSide | None, joints: tuple[int, ...]) -> tuple[str, ...]:
    called = [
        name
        for name, frame in tree.frames.items()
        if any(word in name.lower() for word in CUFF_WORDS)
        # A machine that begins at the elbow holds the upper arm by its base.
        and (frame.body in joints or name.startswith(PLACED))
        and _fits(name, side)
    ]
    placed = [name for name in called if name.startswith(PLACED)]
    return tuple(sorted(placed or called, key=lambda name: tree.frames[name].body))


def _upper_arm(tree: Tree, joints: tuple[int, ...], first: Place | None) -> Length | None:
    """Distance from the shoulder axes to the elbow axis.

    None if the first offset between joints is not along one axis. `first` is the place by the first joint's name.
    """
    # The first joint is no shoulder in a machine that begins at the elbow.
    for i in joints if first == "elbow" or (first is None and len(joints) == 1) else joints[1:]:
        p = tree.joints[i].p_parent_joint
        along = np.flatnonzero(np.abs(p) > SAME_M)
        if len(along) == 1:
            return Length(tree.joints[i].name, "xyz"[along[0]], float(abs(p[along[0]])))
        if len(along) > 1:
            return None
    return None


def sides_in(name: str) -> set[ArmSide]:
    """Sides that a name contains."""
    lower = name.lower()
    sides: tuple[ArmSide, ArmSide] = ("right", "left")
    return {side for side in sides if side in lower or lower.startswith(f"{side[0]}_") or lower.endswith(f"_{side[0]}")}


def _fits(name: str, side: ArmSide | None) -> bool:
    return side is None or side in sides_in(name)
