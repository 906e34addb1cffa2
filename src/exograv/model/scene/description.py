"""Description of a picture: joints of the machine, shapes on its bodies, and points of the arms."""

import hashlib
import json
from dataclasses import asdict, dataclass
from functools import cached_property
from typing import Literal

from exograv.model.rig_settings import ArmSide
from exograv.model.tree import Matrix, Vector
from exograv.options import Side

Point = tuple[float, float, float]
"""Point [m] or direction [-] in the frame of a body: x forward, y left, z up for the base."""

Role = Literal["machine", "drive", "cuff", "stand", "skin", "shirt", "trousers", "hair"]
"""Part of the picture that a shape belongs to. The page chooses its colour."""

BASE = -1
"""Number of the body that does not move."""

DECIMALS = 5
"""Decimals of written numbers: 0.01 mm, and 0.001° in a rotation."""


@dataclass(frozen=True)
class SceneJoint:
    """Joint of the machine. The body with the joint's number moves with it."""

    name: str
    kind: Literal["revolute", "prismatic"]
    parent: int
    R: tuple[float, ...]
    """Rotation of the joint's frame in the parent's frame, row by row (9,)."""

    p: Point
    """Origin of the joint in the parent's frame [m]."""

    axis: Point
    lower: float | None
    """Smallest position [rad] or [m]; None without a limit."""

    upper: float | None
    """Largest position [rad] or [m]; None without a limit."""

    rest: float
    """Position in which the cuffs are fastened [rad] or [m]."""

    has_motor: bool


@dataclass(frozen=True)
class Shape:
    """Shape to draw, such as a capsule or a mesh, fixed to a body of the machine or to the base."""

    kind: Literal["capsule", "cylinder", "ring", "ball", "box", "hand", "mesh"]
    body: int
    role: Role
    points: tuple[Point, ...]
    """Ends of a capsule or cylinder; centre of a ball or box; centre of a ring and a point on its axis;
    wrist and finger tip of a hand, and its thumb's direction [m]."""

    radius: tuple[float, ...] = ()
    """Radius at each end of a capsule; radius of a cylinder, ball or wrist; radius and thickness of a ring [m]."""

    size: Point | None = None
    """Edges of a box [m]; scale of a capsule or ball along x, y and z of its body [-]."""

    R: tuple[float, ...] | None = None
    """Rotation of a box or mesh in its body, row by row (9,); None if they agree."""

    triangles: str | None = None
    """Corners of a mesh in the frame of its body [m]: float32, nine per triangle, in base64."""


@dataclass(frozen=True)
class BodyPoint:
    """Point of the arm that moves with a body of the machine."""

    body: int
    p: Point


@dataclass(frozen=True)
class SceneArm:
    """Arm of the wearer, drawn through shoulder, elbow, wrist and finger tip."""

    side: ArmSide
    lengths: tuple[float, float, float]
    """Lengths of upper arm, forearm and hand [m]."""

    radius: tuple[float, float, float, float]
    """Radius at shoulder, elbow, wrist and finger tip [m]."""

    points: tuple[BodyPoint, BodyPoint, BodyPoint, BodyPoint]
    """Shoulder, elbow, wrist and finger tip of an arm that moves exactly with its cuffs."""

    thumb: BodyPoint
    """Body that turns the hand, and the direction of the thumb in it [-]."""


@dataclass(frozen=True)
class SceneDescription:
    """Person in a machine, at any position of the machine's joints."""

    rig: str
    title: str
    side: Side
    joints: tuple[SceneJoint, ...]
    shapes: tuple[Shape, ...]
    arms: tuple[SceneArm, ...]
    floor: float
    """Height of the floor in the base frame [m]."""

    centre: Point
    """Middle of the person's trunk [m], around which a view turns."""

    note: str = ""
    """Reason why a mesh of the machine is not drawn; empty if all are."""

    @cached_property
    def text(self) -> str:
        """Description as JSON, for a page."""
        return json.dumps(rounded(asdict(self)), ensure_ascii=False, separators=(",", ":"))

    @cached_property
    def key(self) -> str:
        """Short hash of the description. A page fetches the description again when it changes."""
        return hashlib.sha256(self.text.encode()).hexdigest()[:12]


def point_of(vector: Vector) -> Point:
    """Return a vector as a tuple of three numbers."""
    x, y, z = vector.tolist()
    return x, y, z


def rows_of(R: Matrix) -> tuple[float, ...]:
    """Matrix as nine plain numbers, row by row."""
    return tuple(R.ravel().tolist())


def rounded(value: object) -> object:
    """Round all numbers in lists and dictionaries, to keep a message small."""
    match value:
        case float():
            return round(value, DECIMALS) + 0.0
        case dict():
            return {name: rounded(entry) for name, entry in value.items()}
        case list() | tuple():
            return [rounded(entry) for entry in value]
        case _:
            return value
