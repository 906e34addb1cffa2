"""Content of an OpenSim file that a rigid arm needs: bodies, joints, coordinates and couplings, of either layout."""

from collections import Counter
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from xml.etree import ElementTree
from xml.etree.ElementTree import Element

import numpy as np
from jaxtyping import Float
from numpy.polynomial import Polynomial

from exograv.errors import ModelError

from .functions import Function, after, read_function, single_function
from .joints import Axis, axes_of
from .turns import turn
from .values import flag, numbers, text

GROUND = "ground"
RANGE_ABSENT = (-np.pi, np.pi)
"""Range of a coordinate that states none or an endless one [rad, m]."""

Pose = Float[np.ndarray, "4 4"]
"""Pose of a frame as a homogeneous matrix [-, m]."""


@dataclass(frozen=True)
class OsimBody:
    """Mass distribution of a body, in its own frame."""

    mass: float
    com: Float[np.ndarray, " 3"]
    inertia: Float[np.ndarray, " 6"]
    """Moments xx, yy, zz and products xy, xz, yz about the centre of mass [kg·m²]."""


@dataclass(frozen=True)
class OsimCoordinate:
    """Coordinate of a joint [rad, m]."""

    name: str
    default: float
    low: float
    high: float
    is_locked: bool


@dataclass(frozen=True)
class OsimJoint:
    """Joint that places a body on its parent."""

    name: str
    parent: str
    T_parent_F: Pose
    """Pose of the joint's frame on the parent."""

    T_child_M: Pose
    """Pose of the joint's frame on the child."""

    coordinates: tuple[OsimCoordinate, ...]
    axes: tuple[Axis, ...]
    """Rotations in the order in which the child turns, then translations along axes of the parent's frame."""

    problem: str = ""
    """Sentence that says why the joint cannot be used; empty if it can."""


@dataclass(frozen=True)
class OsimCoupling:
    """Coordinate that follows another one."""

    leader: str
    law: Function
    problem: str = ""


@dataclass(frozen=True)
class OsimDocument:
    """Model of an OpenSim file."""

    path: Path
    title: str
    gravity: Float[np.ndarray, " 3"]
    bodies: Mapping[str, OsimBody]
    joints: Mapping[str, OsimJoint]
    """Joints by the name of their child."""

    couplings: Mapping[str, OsimCoupling]
    """Couplings by the coordinate that follows."""

    forces: Mapping[str, int]
    """Number of forces and muscles by class."""

    constraints: Mapping[str, int]
    """Number of constraints other than couplings, by class."""

    def coordinates(self) -> Iterator[tuple[str, OsimCoordinate]]:
        """Yield all coordinates, with the bodies that they move."""
        for child, joint in self.joints.items():
            for coordinate in joint.coordinates:
                yield child, coordinate

    def carries(self, above: str, body: str) -> bool:
        """Return True if `above` is `body`, or lies between it and the ground."""
        seen: set[str] = set()
        while body != above and body in self.joints and body not in seen:
            seen.add(body)
            body = self.joints[body].parent
        return body == above

    def path_to(self, body: str) -> list[str]:
        """Return the bodies from the one on the ground to `body`.

        Raises:
            ModelError: The body does not hang on the ground.
        """
        chain: list[str] = []
        while body != GROUND:
            if body in chain or body not in self.joints:
                raise ModelError(
                    f"{self.path}: body '{(chain or [body])[0]}' is not connected to the ground: '{body}' is the child "
                    "of no joint, or of itself. Make each joint lead away from the ground."
                )
            chain.insert(0, body)
            body = self.joints[body].parent
        return chain


def read_opensim(content: str, path: Path) -> OsimDocument:
    """Read the text of an OpenSim file.

    Raises:
        ModelError: The text is not a model of OpenSim, or has no bodies.
    """
    # Entities can read other files or grow without bound; no model needs a document type.
    if "<!DOCTYPE" in content or "<!ENTITY" in content:
        raise ModelError(f"{path} declares a document type or entities; an OpenSim model needs none. Remove them.")
    try:
        root = ElementTree.fromstring(content)
    except (ElementTree.ParseError, ValueError, RecursionError) as error:
        raise ModelError(f"{path} is not valid XML: {error}. Correct it at that place.") from error
    model = root.find("Model")
    if root.tag != "OpenSimDocument" or model is None:
        raise ModelError(f"{path} has no <Model> in <OpenSimDocument>. Give the .osim file of a model.")
    bodies = _bodies(model, path)
    joints = dict(_joints(model, bodies, path))
    _refuse_twice(
        [coordinate.name for joint in joints.values() for coordinate in joint.coordinates], "coordinate", path
    )
    couplings, constraints = _constraints(model, path)
    return OsimDocument(
        path,
        model.get("name") or path.stem,
        numbers(model, "gravity", f"{path}", 3, (0.0, -9.80665, 0.0)),
        bodies,
        joints,
        couplings,
        Counter(force.tag for force in model.iterfind("ForceSet/objects/*")),
        constraints,
    )


def _bodies(model: Element, path: Path) -> dict[str, OsimBody]:
    elements = [one for one in model.iterfind("BodySet/objects/Body") if one.get("name", "").lower() != GROUND]
    _refuse_twice([one.get("name", "") for one in elements], "body", path)
    if not elements:
        raise ModelError(f"{path} has no bodies in <BodySet>. Give the .osim file of a whole model.")
    return {one.get("name", ""): _body(one, f"{path}: body '{one.get('name', '')}'") for one in elements}


def _body(element: Element, where: str) -> OsimBody:
    zero = (0.0,)
    if element.find("inertia") is not None:
        inertia = numbers(element, "inertia", where, 6)
    else:
        sides = ("xx", "yy", "zz", "xy", "xz", "yz")
        inertia = np.concatenate([numbers(element, f"inertia_{side}", where, 1, zero) for side in sides])
    mass = float(numbers(element, "mass", where, 1, zero)[0])
    return OsimBody(mass, numbers(element, "mass_center", where, 3, (0.0, 0.0, 0.0)), inertia)


def _joints(model: Element, bodies: Mapping[str, OsimBody], path: Path) -> Iterator[tuple[str, OsimJoint]]:
    old = [(joint, body) for body in model.iterfind("BodySet/objects/Body") for joint in body.iterfind("Joint/*")]
    named = {(one.get("name") or "", f.get("name") or ""): f for one in model.iter() for f in one.iterfind("frames/*")}
    shared = {frame.get("name") or "": frame for frame in model.iter("PhysicalOffsetFrame")}
    seen: set[str] = set()
    for joint, body in old or [(joint, None) for joint in model.iterfind("JointSet/objects/*")]:
        name = joint.get("name") or (body.get("name") if body is not None else None) or joint.tag
        where = f"{path}: joint '{name}'"
        if body is not None:
            parent, T_parent_F = (
                text(joint, "parent_body"),
                _pose(joint, "location_in_parent", "orientation_in_parent", where),
            )
            child = body.get("name", "")
            in_child = joint.find("location_in_child") is not None
            T_child_M = _pose(
                joint,
                *(("location_in_child", "orientation_in_child") if in_child else ("location", "orientation")),
                where,
            )
        else:
            own = shared | {frame.get("name") or "": frame for frame in joint.iterfind("frames/*")}
            parent, T_parent_F = _frame(joint, "socket_parent_frame", own, named, where)
            child, T_child_M = _frame(joint, "socket_child_frame", own, named, where)
        parent = GROUND if parent.lower() == GROUND else parent
        for end in (child, parent):
            if end != GROUND and end not in bodies:
                raise ModelError(f"{where} connects '{end}', which is no body of the file. Correct it there.")
        problem = ""
        if child in seen:
            problem = f"{where}: body '{child}' is the child of two joints, a closed loop. Remove one of the joints."
        elif flag(joint, "reverse"):
            problem = f"{where} is reversed. Exchange its parent and its child."
        seen.add(child)
        yield child, _joint(joint, name, parent, T_parent_F, T_child_M, where, problem)


def _joint(
    element: Element, name: str, parent: str, T_parent_F: Pose, T_child_M: Pose, where: str, problem: str
) -> OsimJoint:
    found = [*element.iterfind("coordinates/*"), *element.iterfind("CoordinateSet/objects/*")]
    coordinates = tuple(_coordinate(one, where) for one in found)
    axes: tuple[Axis, ...] = ()
    try:
        axes = axes_of(element, [one.name for one in coordinates], where)
    except ModelError as error:
        problem = problem or str(error)  # refused only if the arm has this joint
    return OsimJoint(name, parent, T_parent_F, T_child_M, coordinates, axes, problem)


def _coordinate(element: Element, where: str) -> OsimCoordinate:
    name = element.get("name") or ""
    place = f"{where}, coordinate '{name}'"
    is_endless = "inf" in text(element, "range").lower()
    low, high = RANGE_ABSENT if is_endless else numbers(element, "range", place, 2, RANGE_ABSENT)
    default = float(numbers(element, "default_value", place, 1, (0.0,))[0])
    return OsimCoordinate(
        name, default, float(low), float(high), flag(element, "locked") or flag(element, "prescribed")
    )


def _pose(element: Element, location: str, orientation: str, where: str) -> Pose:
    T = np.eye(4)
    for axis, angle in zip(np.eye(3), numbers(element, orientation, where, 3, (0.0, 0.0, 0.0)), strict=True):
        T[:3, :3] = T[:3, :3] @ turn(axis, float(angle))
    T[:3, 3] = numbers(element, location, where, 3, (0.0, 0.0, 0.0))
    return T


def _frame(
    holder: Element, tag: str, own: Mapping[str, Element], named: Mapping[tuple[str, str], Element], where: str
) -> tuple[str, Pose]:
    """Return the body on which a frame is fixed, and the frame's pose on it."""
    T = np.eye(4)
    for _ in range(10):  # frames on frames; a longer chain is a circle
        target = text(holder, tag)
        parts = target.split("/")
        last = parts[-1]
        holder_of = parts[-2] if len(parts) > 1 else ""
        if (holder_of, last) in named:
            frame = named[holder_of, last]
        elif holder_of in ("", "..") and last in own:
            frame = own[last]
        else:
            frame = None if not last or "bodyset" in parts or last not in own else own[last]
        if frame is None:
            if not last:
                raise ModelError(f"{where} has no {tag}. Open the file in OpenSim 4 and save it again.")
            return last, T
        T = _pose(frame, "translation", "orientation", where) @ T
        holder, tag = frame, "socket_parent"
    raise ModelError(f"{where}: its frames refer to one another in a circle. Correct their socket_parent.")


def _constraints(model: Element, path: Path) -> tuple[dict[str, OsimCoupling], Counter[str]]:
    couplings: dict[str, OsimCoupling] = {}
    others: Counter[str] = Counter()
    for element in model.iterfind("ConstraintSet/objects/*"):
        if flag(element, "isDisabled") or text(element, "isEnforced").lower() == "false":
            continue
        if element.tag != "CoordinateCouplerConstraint":
            others[element.tag] += 1
            continue
        follower = text(element, "dependent_coordinate_name")
        couplings[follower] = _coupling(element, f"{path}: coupling of coordinate '{follower}'")
    return couplings, others


def _coupling(element: Element, where: str) -> OsimCoupling:
    leaders = text(element, "independent_coordinate_names").split()
    if len(leaders) != 1:
        problem = f"{where} follows {len(leaders)} coordinates; exograv reads one. Couple it to one, or lock it."
        return OsimCoupling("", lambda q: q, problem)
    try:
        scale = float(numbers(element, "scale_factor", where, 1, (1.0,))[0])
        holder = element.find("coupled_coordinates_function")
        law = read_function(single_function(holder, where), where)
    except ModelError as error:
        return OsimCoupling(leaders[0], lambda q: q, str(error))
    return OsimCoupling(leaders[0], after(Polynomial([0.0, scale]), law))


def _refuse_twice(names: list[str], what: str, path: Path) -> None:
    twice = [name for name, count in Counter(names).items() if count > 1]
    if twice:
        raise ModelError(f"{path}: more than one {what} is called '{twice[0]}'. Give each its own name.")
