"""Joints and links of a machine, read from its URDF without exograv."""

import xml.etree.ElementTree as ElementTree
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from jaxtyping import Float


@dataclass(frozen=True)
class Geometry:
    """Serial chain of revolute joints, base first, with the link that each joint moves."""

    joints: tuple[str, ...]
    axis: Float[np.ndarray, "joint 3"]
    origin: Float[np.ndarray, "joint 3"]
    """Origin of each joint in the link before it [m]."""
    rotation: Float[np.ndarray, "joint 3 3"]
    lower: Float[np.ndarray, " joint"]
    upper: Float[np.ndarray, " joint"]
    mass: Float[np.ndarray, " joint"]
    com: Float[np.ndarray, "joint 3"]
    inertia: Float[np.ndarray, "joint 3 3"]
    """Inertia about the centre of mass, in the axes of the link [kg·m²]."""
    mounts: dict[str, tuple[int, Float[np.ndarray, " 3"]]]
    """Number of the link and place in it [m] of each frame that is fixed to a moving link."""
    mount_axes: dict[str, Float[np.ndarray, "3 3"]]
    """Axes of each of these frames in its link, as columns."""

    def pose(
        self, mount: str, q: Float[np.ndarray, " joint"]
    ) -> tuple[Float[np.ndarray, "3 3"], Float[np.ndarray, " 3"]]:
        """Return the axes of a mount, as columns, and its place [m] in the base."""
        link, place = self.mounts[mount]
        R, p = np.eye(3), np.zeros(3)
        for joint, angle in enumerate(q[: link + 1].tolist()):
            p = p + R @ self.origin[joint]
            R = R @ self.rotation[joint] @ _turn(self.axis[joint], angle)
        return R @ self.mount_axes[mount], p + R @ place


def read_geometry(path: Path) -> Geometry:
    """Read a chain whose links have at most one revolute child."""
    root = ElementTree.parse(path).getroot()
    links = {link.attrib["name"]: link for link in root.iter("link")}
    joints = [joint for joint in root.iter("joint") if joint.attrib["type"] == "revolute"]
    order = {_link(joint, "child"): number for number, joint in enumerate(joints)}
    mounts, axes = {}, {}
    for joint in root.iter("joint"):
        if joint.attrib["type"] == "fixed" and _link(joint, "parent") in order:
            place, turned = _pose(joint)
            mounts[_link(joint, "child")] = order[_link(joint, "parent")], place
            axes[_link(joint, "child")] = turned
    if any(_link(joint, "parent") != child for joint, child in zip(joints[1:], order, strict=False)):
        raise ValueError(f"{path} is no serial chain in the order of its joints.")
    mass, com, inertia = (np.array(each) for each in zip(*(_inertial(links[child]) for child in order), strict=True))
    origin, rotation = (np.array(each) for each in zip(*map(_pose, joints), strict=True))
    limits = [_child(joint, "limit").attrib for joint in joints]
    return Geometry(
        tuple(joint.attrib["name"] for joint in joints),
        np.array([_numbers(_child(joint, "axis").attrib["xyz"]) for joint in joints]),
        origin,
        rotation,
        np.array([float(limit["lower"]) for limit in limits]),
        np.array([float(limit["upper"]) for limit in limits]),
        mass,
        com,
        inertia,
        mounts,
        axes,
    )


def lengthened(geometry: Geometry, joint: str, axis: str, length_m: float) -> Geometry:
    """Return the machine with a joint at this distance from the one before it, along an axis of the link between."""
    origin, place = geometry.origin.copy(), (geometry.joints.index(joint), "xyz".index(axis))
    origin[place] = np.copysign(length_m, origin[place])
    return replace(geometry, origin=origin)


def with_links(urdf: str, links: Mapping[str, Float[np.ndarray, " 10"]]) -> str:
    """Return a URDF in which the link behind each joint has all mass; order of the parameters as in exograv."""
    root = ElementTree.fromstring(urdf)
    moved = {_link(joint, "child"): joint.attrib["name"] for joint in root.iter("joint")}
    for link in root.iter("link"):
        for old in link.findall("inertial"):
            link.remove(old)
        phi = links.get(moved.get(link.attrib["name"], ""))
        if phi is None:
            continue
        mass, com = float(phi[0]), phi[1:4] / phi[0]
        xx, xy, yy, xz, yz, zz = (phi[4:] - mass * _apart(com)).tolist()
        made = ElementTree.SubElement(link, "inertial")
        ElementTree.SubElement(made, "origin", xyz=" ".join(map(repr, com.tolist())), rpy="0 0 0")
        ElementTree.SubElement(made, "mass", value=repr(mass))
        moments = {"ixx": xx, "ixy": xy, "ixz": xz, "iyy": yy, "iyz": yz, "izz": zz}
        ElementTree.SubElement(made, "inertia", {name: repr(value) for name, value in moments.items()})
    return ElementTree.tostring(root, encoding="unicode")


def _apart(com: Float[np.ndarray, " 3"]) -> Float[np.ndarray, " 6"]:
    """Moments about the origin of a unit mass at `com` [m²]."""
    square = com @ com * np.eye(3) - np.outer(com, com)
    return square[[0, 0, 1, 0, 1, 2], [0, 1, 1, 2, 2, 2]]


def _turn(axis: Float[np.ndarray, " 3"], angle: float) -> Float[np.ndarray, "3 3"]:
    """Rotation about a unit axis [rad] (Rodrigues)."""
    x, y, z = axis.tolist()
    across = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return np.eye(3) + np.sin(angle) * across + (1.0 - np.cos(angle)) * across @ across


def _child(element: ElementTree.Element, name: str) -> ElementTree.Element:
    found = element.find(name)
    if found is None:
        raise ValueError(f"{element.attrib['name']} has no <{name}>.")
    return found


def _link(joint: ElementTree.Element, end: str) -> str:
    return _child(joint, end).attrib["link"]


def _numbers(text: str) -> list[float]:
    return [float(word) for word in text.split()]


def _pose(element: ElementTree.Element) -> tuple[Float[np.ndarray, " 3"], Float[np.ndarray, "3 3"]]:
    origin = element.find("origin")
    values = {} if origin is None else origin.attrib
    roll, pitch, yaw = _numbers(values.get("rpy", "0 0 0"))
    (cr, cp, cy), (sr, sp, sy) = np.cos([roll, pitch, yaw]), np.sin([roll, pitch, yaw])
    about_x = np.array([[1.0, 0.0, 0.0], [0.0, cr, -sr], [0.0, sr, cr]])
    about_y = np.array([[cp, 0.0, sp], [0.0, 1.0, 0.0], [-sp, 0.0, cp]])
    about_z = np.array([[cy, -sy, 0.0], [sy, cy, 0.0], [0.0, 0.0, 1.0]])
    return np.array(_numbers(values.get("xyz", "0 0 0"))), about_z @ about_y @ about_x


def _inertial(link: ElementTree.Element) -> tuple[float, Float[np.ndarray, " 3"], Float[np.ndarray, "3 3"]]:
    inertial = _child(link, "inertial")
    com, R = _pose(inertial)
    given = _child(inertial, "inertia").attrib
    xx, yy, zz, xy, xz, yz = (float(given[f"i{name}"]) for name in ("xx", "yy", "zz", "xy", "xz", "yz"))
    inertia = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    return float(_child(inertial, "mass").attrib["value"]), com, R @ inertia @ R.T
