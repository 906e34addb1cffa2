"""Axes of the joints of an OpenSim file, by class of the joint."""

from collections.abc import Sequence
from dataclasses import dataclass
from xml.etree.ElementTree import Element

import numpy as np
from jaxtyping import Float
from numpy.polynomial import Polynomial

from exograv.errors import ModelError

from .functions import Function, read_function, single_function
from .values import numbers, text

X, Y, Z = np.eye(3)
ROTATIONS = {
    "WeldJoint": (), "PinJoint": (Z,), "UniversalJoint": (X, Y), "GimbalJoint": (X, Y, Z), "BallJoint": (X, Y, Z),
    "FreeJoint": (X, Y, Z), "PlanarJoint": (Z,), "SliderJoint": (),
}  # fmt: skip
"""Axes about which the child turns, in this order, by class. Source: class documentation of OpenSim 4."""

TRANSLATIONS = {"SliderJoint": (X,), "PlanarJoint": (X, Y), "FreeJoint": (X, Y, Z)}
"""Axes along which the child moves, in the frame on the parent."""

AXES = ("rotation1", "rotation2", "rotation3", "translation1", "translation2", "translation3")


@dataclass(frozen=True)
class Axis:
    """Axis of a joint, and the function of a coordinate that moves the child about or along it."""

    name: str
    direction: Float[np.ndarray, " 3"]
    """Unit vector; after the axes before it have turned, for a rotation."""

    is_slide: bool
    coordinate: str
    """Coordinate of the function; empty if the function is a constant."""

    function: Function


def axes_of(element: Element, coordinates: Sequence[str], where: str) -> tuple[Axis, ...]:
    """Return the axes of a joint.

    Raises:
        ModelError: The class of the joint is unknown, or its transform cannot be represented.
    """
    if element.tag == "CustomJoint":
        by_name = {one.get("name"): one for one in element.iterfind("SpatialTransform/TransformAxis")}
        axes = [_custom_axis(by_name[name], name, coordinates, where) for name in AXES if name in by_name]
        return tuple(axis for axis in axes if axis.coordinate or axis.function(0.0))
    if element.tag not in ROTATIONS:
        raise ModelError(
            f"{where} is a {element.tag}, which exograv cannot represent. Known: CustomJoint, {', '.join(ROTATIONS)}. "
            "Replace it in OpenSim, or use a model without it."
        )
    moves = [(axis, False) for axis in ROTATIONS[element.tag]]
    moves += [(axis, True) for axis in TRANSLATIONS.get(element.tag, ())]
    if len(coordinates) < len(moves):
        raise ModelError(
            f"{where} is a {element.tag} with {len(coordinates)} coordinates; it needs {len(moves)}. Add them there."
        )
    return tuple(
        Axis(f"axis{k + 1}", axis, is_slide, coordinates[k], Polynomial([0.0, 1.0]))
        for k, (axis, is_slide) in enumerate(moves)
    )


def _custom_axis(element: Element, name: str, coordinates: Sequence[str], where: str) -> Axis:
    place = f"{where}, {name}"
    used = text(element, "coordinates").split()
    if len(used) > 1:
        raise ModelError(f"{place} depends on {len(used)} coordinates; exograv reads one. Couple or lock them.")
    if used and used[0] not in coordinates:
        raise ModelError(f"{place}: the joint has no coordinate '{used[0]}'. It has: {', '.join(coordinates)}.")
    direction = numbers(element, "axis", place, 3)
    length = float(np.linalg.norm(direction))
    if length == 0.0:
        raise ModelError(f"{place} has the axis 0 0 0. Give it a direction.")
    wrapped = element.find("function")
    inline = [child for child in element if child.tag not in ("coordinates", "axis", "function")]
    if wrapped is not None and len(wrapped):
        function = read_function(single_function(wrapped, place), place)
    elif inline:
        function = read_function(inline[0], place)
    else:
        function = Polynomial([0.0, 1.0] if used else [0.0])
    is_slide = name.startswith("translation")
    return Axis(name, direction / length, is_slide, used[0] if used else "", function)
