"""Texts of OpenSim models, in the layout of version 3 or 4, from bodies and joints; made anew, copied from no model."""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Literal
from xml.etree import ElementTree

Layout = Literal[3, 4]
Triple = tuple[float, float, float]
ZERO: Triple = (0.0, 0.0, 0.0)


@dataclass(frozen=True)
class Coordinate:
    """Coordinate of a joint."""

    name: str
    default: float = 0.0
    low: float = -2.0
    high: float = 2.0
    locked: bool = False


@dataclass(frozen=True)
class TransformAxis:
    """Axis of a custom joint, with the text of its function."""

    coordinate: str
    axis: Triple
    function: str = ""
    """Text of the function; the coordinate itself if empty."""

    slot: str = ""
    """Name such as `translation1`; the next free rotation if empty."""


@dataclass(frozen=True)
class Part:
    """Body, and the joint that carries it."""

    body: str
    parent: str = "ground"
    at: Triple = ZERO
    turned: Triple = ZERO
    """Turns of the joint's frame on the parent about x, y, z."""

    own_at: Triple = ZERO
    own_turned: Triple = ZERO
    mass: float = 0.0
    com: Triple = ZERO
    inertia: Sequence[float] = (0.0,) * 6
    kind: str = "CustomJoint"
    coordinates: Sequence[Coordinate] = ()
    axes: Sequence[TransformAxis] = ()
    extra: str = ""
    """Further elements of the joint."""


@dataclass(frozen=True)
class Model:
    """Model, and the texts of its couplings and forces."""

    parts: Sequence[Part]
    couplings: Sequence[str] = ()
    forces: str = ""
    gravity: Triple = (0.0, -9.80665, 0.0)
    name: str = "synthetic"
    extra: str = field(default="")

    def with_part(self, body: str, **changes: object) -> "Model":
        """Return the model with a changed part."""
        assert any(part.body == body for part in self.parts)
        return replace(self, parts=[replace(part, **changes) if part.body == body else part for part in self.parts])


def coupling(follower: str, leader: str, function: str, extra: str = "") -> str:
    """Text of a constraint that lets a coordinate follow another one."""
    return (
        f'<CoordinateCouplerConstraint name="{follower}_con">{extra}<coupled_coordinates_function>{function}'
        f"</coupled_coordinates_function><independent_coordinate_names>{leader}</independent_coordinate_names>"
        f"<dependent_coordinate_name>{follower}</dependent_coordinate_name></CoordinateCouplerConstraint>"
    )


def spline(x: Sequence[float], y: Sequence[float], kind: str = "SimmSpline") -> str:
    """Text of a function through nodes."""
    return f"<{kind}><x>{_row(x)}</x><y>{_row(y)}</y></{kind}>"


def osim(model: Model, layout: Layout = 4) -> str:
    """Text of an OpenSim file."""
    bodies = "".join(_body(part, layout) for part in model.parts)
    if layout == 3:
        bodies = f'<Body name="ground"><mass>0</mass><Joint /></Body>{bodies}'
        joints = ""
    else:
        joints = f"<JointSet><objects>{''.join(_joint(part) for part in model.parts)}</objects></JointSet>"
    text = (
        f'<OpenSimDocument Version="{layout}0000"><Model name="{model.name}"><gravity>{_row(model.gravity)}</gravity>'
        f"<BodySet><objects>{bodies}</objects></BodySet>{joints}<ConstraintSet><objects>{''.join(model.couplings)}"
        f"</objects></ConstraintSet><ForceSet><objects>{model.forces}</objects></ForceSet>{model.extra}</Model>"
        "</OpenSimDocument>"
    )
    root = ElementTree.fromstring(text)
    ElementTree.indent(root)
    return '<?xml version="1.0" encoding="UTF-8"?>\n' + ElementTree.tostring(root, encoding="unicode")


def linear(slope: float = 1.0, at_zero: float = 0.0) -> str:
    """Text of a straight line."""
    return f"<LinearFunction><coefficients>{slope!r} {at_zero!r}</coefficients></LinearFunction>"


def _row(values: Sequence[float]) -> str:
    return " ".join(repr(float(value)) for value in values)


def _body(part: Part, layout: Layout) -> str:
    if layout == 4:
        inertia, joint = f"<inertia>{_row(part.inertia)}</inertia>", ""
    else:
        sides = ("xx", "yy", "zz", "xy", "xz", "yz")
        rows = zip(sides, part.inertia, strict=True)
        inertia = "".join(f"<inertia_{side}>{float(value)!r}</inertia_{side}>" for side, value in rows)
        joint = f"<Joint>{_joint_of_layout_3(part)}</Joint>"
    return (
        f'<Body name="{part.body}"><mass>{part.mass!r}</mass><mass_center>{_row(part.com)}</mass_center>'
        f"{inertia}{joint}</Body>"
    )


def _coordinates(part: Part) -> str:
    return "".join(
        f'<Coordinate name="{one.name}"><default_value>{one.default!r}</default_value>'
        f"<range>{one.low!r} {one.high!r}</range><locked>{str(one.locked).lower()}</locked></Coordinate>"
        for one in part.coordinates
    )


def _joint(part: Part) -> str:
    parent = "/ground" if part.parent == "ground" else f"/bodyset/{part.parent}"
    return (
        f'<{part.kind} name="{part.body}_joint"><socket_parent_frame>{part.parent}_offset</socket_parent_frame>'
        f"<socket_child_frame>{part.body}_offset</socket_child_frame><coordinates>{_coordinates(part)}</coordinates>"
        f"<frames>{_frame(f'{part.parent}_offset', parent, part.at, part.turned)}"
        f"{_frame(f'{part.body}_offset', f'/bodyset/{part.body}', part.own_at, part.own_turned)}</frames>"
        f"{_transform(part, 4)}{part.extra}</{part.kind}>"
    )


def _frame(name: str, parent: str, at: Triple, turned: Triple) -> str:
    return (
        f'<PhysicalOffsetFrame name="{name}"><socket_parent>{parent}</socket_parent>'
        f"<translation>{_row(at)}</translation><orientation>{_row(turned)}</orientation></PhysicalOffsetFrame>"
    )


def _joint_of_layout_3(part: Part) -> str:
    return (
        f'<{part.kind} name="{part.body}_joint"><parent_body>{part.parent}</parent_body>'
        f"<location_in_parent>{_row(part.at)}</location_in_parent>"
        f"<orientation_in_parent>{_row(part.turned)}</orientation_in_parent><location>{_row(part.own_at)}</location>"
        f"<orientation>{_row(part.own_turned)}</orientation><CoordinateSet><objects>{_coordinates(part)}</objects>"
        f"</CoordinateSet>{_transform(part, 3)}{part.extra}</{part.kind}>"
    )


def _transform(part: Part, layout: Layout) -> str:
    if part.kind != "CustomJoint":
        return ""
    slots = [f"{what}{k}" for what in ("rotation", "translation") for k in (1, 2, 3)]
    directions = [(1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)] * 2
    rows = {
        slot: TransformAxis("", axis, "<Constant><value>0</value></Constant>")
        for slot, axis in zip(slots, directions, strict=True)
    }
    turns = iter(slots)
    for axis in part.axes:
        rows[axis.slot or next(turns)] = axis
    text = ""
    for slot, row in rows.items():
        written = row.function or linear()
        function = f"<function>{written}</function>" if layout == 3 else written
        text += (
            f'<TransformAxis name="{slot}"><coordinates>{row.coordinate}</coordinates><axis>{_row(row.axis)}</axis>'
            f"{function}</TransformAxis>"
        )
    return f"<SpatialTransform>{text}</SpatialTransform>"
