"""Reader of URDF files; it refuses files that could cause harm later.

It does not use the importers of MuJoCo or Pinocchio: the twin and the test oracles use those and must stay independent.
"""

import math
import xml.etree.ElementTree as ElementTree
from collections import Counter
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
from jaxtyping import Float

from exograv.errors import ModelError, ModelFaultsError

from .tree import Frame, Joint, Matrix, Tree, Vector, inertia_about_origin, inertial_parameters, is_physical

SIZE_MAX_BYTES = 1_000_000  # far above any exoskeleton's description; a larger file is a mistake or an attack
NUMBER_MAX = 1e6  # no length, mass, inertia or limit of an exoskeleton in SI units is larger; products would overflow
MESHES = "meshes"
"""Attribute that a converter to URDF sets on a link without inertial: the meshes that hold its mass, not read."""
MOVING = {"revolute": "revolute", "continuous": "revolute", "prismatic": "prismatic"}


def read_urdf(path: Path) -> Tree:
    """Read the kinematic tree of a URDF file.

    Links behind fixed joints become frames, and their masses are added to the parents.

    Raises:
        ModelError: The file cannot be used; the message says what, where, what is allowed and what to do next.
        ModelFaultsError: The file has several such faults.
    """
    return tree_of(robot_of(path), path)


def tree_of(robot: ElementTree.Element, path: Path) -> Tree:
    """Return the kinematic tree of the root element of a URDF; `path` is its file, for messages.

    Raises:
        ModelError: As `read_urdf`.
    """
    where = path.name
    refuse_faults(element_faults(robot, where))
    links = {_name(link, where): link for link in robot.findall("link")}
    joints = {_name(joint, where): joint for joint in robot.findall("joint")}
    moved = {_end(joint, "child", name, where) for name, joint in joints.items()}
    root = next(link for link in links if link not in moved)
    return _Builder(where, links, joints).tree(robot.get("name", path.stem), root)


def refuse_faults(faults: list[str]) -> None:
    """Raise one error for all faults of a file.

    Raises:
        ModelError: There are faults.
    """
    if len(faults) == 1:
        raise ModelError(faults[0])
    if faults:
        raise ModelFaultsError(*faults)


def element_faults(robot: ElementTree.Element, where: str) -> list[str]:
    """Return all faults of links, joints and the tree that they form, one sentence each."""
    faults: list[str] = []

    def read(part: Callable[[], object]) -> None:
        try:
            part()
        except ModelError as error:
            faults.append(str(error))

    for element in (*robot.findall("link"), *robot.findall("joint")):
        read(lambda element=element: _name(element, where))
    faults += _repeated_names(robot, where)
    links = {link.get("name", ""): link for link in robot.findall("link")}
    for name, link in links.items():
        inertial = link.find("inertial")
        if inertial is not None:
            read(lambda inertial=inertial, name=name: _inertial_parameters(inertial, name, where))
    for joint in robot.findall("joint"):
        if "" not in links:  # A link without name is a fault already.
            read(lambda joint=joint: _ends(joint, links, where))
        name, kind = joint.get("name", ""), joint.get("type", "")
        read(lambda joint=joint, name=name: origin_of(joint, f"joint '{name}'", where))
        if kind != "fixed":
            read(lambda joint=joint, name=name: _refuse_kind(joint, name, where))
            read(lambda joint=joint, name=name: _axis(joint, name, where))
        if kind in MOVING:
            read(lambda joint=joint, name=name, kind=kind: _limits(joint, name, kind, where))
    return faults + _tree_faults(robot, where)


def _repeated_names(robot: ElementTree.Element, where: str) -> list[str]:
    faults = []
    for tag in ("link", "joint"):
        names = Counter(element.get("name") for element in robot.findall(tag))
        twice = [name for name, count in names.items() if name and count > 1]
        faults += [f"{where}: more than one {tag} is called '{name}'. Give each its own name." for name in twice]
    return faults


def _ends(joint: ElementTree.Element, links: dict[str, ElementTree.Element], where: str) -> tuple[str, str]:
    """Return the names of parent and child, which exist."""
    name = joint.get("name", "")
    parent, child = (_end(joint, end, name, where) for end in ("parent", "child"))
    for link in (parent, child):
        if link not in links:
            raise ModelError(f"{where}: joint '{name}' names link '{link}'. Links there: {', '.join(links)}.")
    return parent, child


def _refuse_kind(joint: ElementTree.Element, name: str, where: str) -> None:
    kind = joint.get("type", "")
    if kind not in MOVING:
        raise ModelError(
            f"{where}: joint '{name}' is of type '{kind}'; allowed: fixed, {', '.join(MOVING)}. Change it."
        )
    if joint.find("mimic") is not None:
        raise ModelError(
            f"{where}: joint '{name}' mimics another; each moving joint needs a motor of its own. "
            "Make it fixed, or remove <mimic>."
        )


def robot_of(path: Path) -> ElementTree.Element:
    """Read the root element of a URDF file.

    Raises:
        ModelError: The file cannot be used.
    """
    return root_of(text_of(path), path.name)


def text_of(path: Path) -> str:
    """Read the text of a description file.

    Raises:
        ModelError: The file cannot be used.
    """
    try:
        with path.open("rb") as file:
            data = file.read(SIZE_MAX_BYTES + 1)
    except IsADirectoryError as error:
        raise ModelError(f"{path} is a folder. Give the URDF file in it.") from error
    except OSError as error:
        raise ModelError(f"{path} cannot be read: {error.strerror}. Check that the file is there.") from error
    if len(data) > SIZE_MAX_BYTES:
        raise ModelError(f"{path.name} has more than the {SIZE_MAX_BYTES} bytes allowed. Move meshes to files.")
    try:
        return data.decode("utf-8")
    except UnicodeDecodeError as error:
        raise ModelError(f"{path.name} is not UTF-8 (byte {error.start}). Save it as UTF-8.") from error


def root_of(text: str, where: str) -> ElementTree.Element:
    """Return the root element of a URDF's text; `where` is its file, for messages.

    Raises:
        ModelError: The text is not a URDF.
    """
    # Entities can read other files or grow without bound; no URDF needs a document type.
    if "<!DOCTYPE" in text or "<!ENTITY" in text:
        raise ModelError(f"{where} declares a document type or entities; URDF needs none. Remove them.")
    try:
        robot = ElementTree.fromstring(text)
    except (ElementTree.ParseError, ValueError, RecursionError) as error:
        raise ModelError(f"{where} is not valid XML: {error}. Correct it at that place.") from error
    if robot.tag != "robot":
        raise ModelError(f"{where} starts with <{robot.tag}>; a URDF starts with <robot>. Convert the file.")
    return robot


def _tree_faults(robot: ElementTree.Element, where: str) -> list[str]:
    """Return all places at which the links are no tree: links with several parents, rings, and several roots.

    Joints that name no link of the file are left out; they are faults of their own.
    """
    links = [name for name in (link.get("name", "") for link in robot.findall("link")) if name]
    below: dict[str, list[tuple[str, str]]] = {link: [] for link in links}
    ends = [
        (joint.get("name", ""), _link_at(joint, "parent"), _link_at(joint, "child")) for joint in robot.findall("joint")
    ]
    for joint, parent, child in ends:
        if parent in below and child in below:
            below[parent].append((joint, child))
    children = {child for rows in below.values() for _, child in rows}
    roots = [link for link in links if link not in children]
    rings = _rings(below, [*roots, *links])
    faults = [
        f"{where} is not a tree: joint '{joint}' leads back to '{ring[0]}'; the links form a ring: {', '.join(ring)}. "
        "Cut it at one joint; cuffs and loops belong in rig.toml."
        for joint, ring in rings.items()
    ]
    parents: dict[str, list[str]] = {}
    for link, rows in below.items():
        for joint, child in rows:
            if joint not in rings:
                parents.setdefault(child, []).append(link)
    faults += [
        f"{where} is not a tree: link '{child}' has the parents {' and '.join(repr(one) for one in several)}. "
        "Cut the loop; cuffs and loops belong in rig.toml."
        for child, several in parents.items()
        if len(several) > 1
    ]
    # A joint that names no link leaves its child without a parent, which is no fault of its own.
    is_connected = all(parent in below and child in below for _, parent, child in ends)
    if (len(roots) > 1 and is_connected) or not links:
        found = ", ".join(roots) or "none"
        faults.append(f"{where} is not a tree: one link must have no parent; found {found}. Connect or cut them.")
    return faults


def _rings(below: dict[str, list[tuple[str, str]]], starts: list[str]) -> dict[str, list[str]]:
    """Return the joints that lead from a link back to one that carries it, and the links of each such ring.

    Args:
        below: Joint and child of each joint on a link, by link.
        starts: Links from which the rings are searched, in this order; every link is among them.
    """
    rings: dict[str, list[str]] = {}
    done: set[str] = set()
    for start in starts:
        path: dict[str, Iterator[tuple[str, str]]] = {} if start in done else {start: iter(below[start])}
        while path:
            link = next(reversed(path))
            joint, child = next(path[link], ("", ""))
            if not child:
                done.add(link)
                del path[link]
            elif child in path:
                carriers = list(path)
                rings[joint] = carriers[carriers.index(child) :]
            elif child not in done:
                path[child] = iter(below[child])
    return rings


def _link_at(joint: ElementTree.Element, end: str) -> str:
    """Name of the link at an end of a joint; empty if the joint names none."""
    element = joint.find(end)
    return "" if element is None else element.get("link", "")


class _Builder:
    """Builder that walks the links from the root and collects joints, bodies and frames."""

    def __init__(self, where: str, links: dict[str, ElementTree.Element], joints: dict[str, ElementTree.Element]):
        self.where, self.links = where, links
        self.children: dict[str, list[tuple[str, ElementTree.Element]]] = {}
        for name, joint in joints.items():
            self.children.setdefault(_end(joint, "parent", name, where), []).append((name, joint))
        self.joints: list[Joint] = []
        self.bodies: list[str] = []
        self.phi: list[Float[np.ndarray, " 10"]] = []
        self.frames: dict[str, Frame] = {}

    def tree(self, name: str, root: str) -> Tree:
        self.frames[root] = Frame(-1, np.eye(3), np.zeros(3))
        pending = self._joints_of(root)
        self._refuse_massless()
        # Depth first, in the file's order: a machine for both arms has one arm after the other.
        while pending:
            parent, joint_name, joint = pending.pop()
            link, frame = self._child(joint_name, joint, self.frames[parent])
            self.frames[link] = frame
            pending += self._joints_of(link)
        if not self.joints:
            raise ModelError(f"{self.where} has no moving joint; it needs at least one. Check the joint types.")
        return self._checked(Tree(name, tuple(self.joints), tuple(self.bodies), np.array(self.phi), self.frames))

    def _refuse_massless(self) -> None:
        """Refuse moving links without mass, all at once."""
        joints = [joint for rows in self.children.values() for _, joint in rows if joint.get("type") != "fixed"]
        ends = [_end(joint, "child", joint.get("name", ""), self.where) for joint in joints]
        bare = [link for link in ends if self.links[link].find("inertial") is None and not self._carries_mass(link)]
        refuse_faults(
            [
                f"{self.where}: link '{link}' moves but has no <inertial>{self._meshes(link)}. Give its mass, centre "
                "and inertia; only links behind fixed joints may be massless."
                for link in bare
            ]
        )

    def _meshes(self, link: str) -> str:
        meshes = self.links[link].get(MESHES)
        return f"; meshes are not read, and its mass is in {meshes}" if meshes else ""

    def _joints_of(self, link: str) -> list[tuple[str, str, ElementTree.Element]]:
        """Joints on a link, in reversed order for the stack."""
        return [(link, *entry) for entry in reversed(self.children.get(link, []))]

    def _child(self, name: str, joint: ElementTree.Element, parent: Frame) -> tuple[str, Frame]:
        body, R, p = parent.body, parent.R_body_frame, parent.p_body_frame
        child = _end(joint, "child", name, self.where)
        R_link_joint, p_link_joint = origin_of(joint, f"joint '{name}'", self.where)
        R_body_joint, p_body_joint = R @ R_link_joint, p + R @ p_link_joint
        kind = joint.get("type", "")
        if kind == "fixed":
            own = self._inertial(child)
            if own is not None and body >= 0:
                self.phi[body] = self.phi[body] + _moved(own, R_body_joint, p_body_joint)
            return child, Frame(body, R_body_joint, p_body_joint)
        lower, upper, effort, velocity = _limits(joint, name, kind, self.where)
        axis = _axis(joint, name, self.where)
        self.joints.append(
            Joint(name, MOVING[kind], body, R_body_joint, p_body_joint, axis, lower, upper, effort, velocity)  # pyright: ignore[reportArgumentType] - values of MOVING
        )
        self.bodies.append(child)
        inertial = self._inertial(child)
        self.phi.append(inertial if inertial is not None else np.zeros(10))
        return child, Frame(len(self.joints) - 1, np.eye(3), np.zeros(3))

    def _inertial(self, link: str) -> Float[np.ndarray, " 10"] | None:
        inertial = self.links[link].find("inertial")
        return None if inertial is None else _inertial_parameters(inertial, link, self.where)

    def _carries_mass(self, link: str) -> bool:
        """Return True if a link that is fixed to this one has a mass; many files put the inertial there."""
        pending = [link]
        while pending:
            for name, joint in self.children.get(pending.pop(), []):
                if joint.get("type") == "fixed":
                    child = _end(joint, "child", name, self.where)
                    if self.links[child].find("inertial") is not None:
                        return True
                    pending.append(child)
        return False

    def _checked(self, tree: Tree) -> Tree:
        for body, phi in zip(tree.bodies, tree.phi, strict=True):
            if not is_physical(phi):
                raise ModelError(f"{self.where}: link '{body}' with what is fixed to it has no physical inertia.")
        return tree


def inertia_fault(inertial: ElementTree.Element, link: str, where: str) -> str | None:
    """Return the fault of an <inertial> whose numbers can be read but that no body has; None if there is none."""
    try:
        phi, moments = _read_inertial(inertial, link, where)
    except ModelError:
        return None
    if is_physical(phi):
        return None
    return (
        f"{where}: no body has the inertia of link '{link}': principal moments {moments} kg·m². Each must be "
        "positive and smaller than the sum of the other two. Correct <inertia>."
    )


def _inertial_parameters(inertial: ElementTree.Element, link: str, where: str) -> Float[np.ndarray, " 10"]:
    phi, _ = _read_inertial(inertial, link, where)
    fault = inertia_fault(inertial, link, where)
    if fault is not None:
        raise ModelError(fault)
    return phi


def _read_inertial(inertial: ElementTree.Element, link: str, where: str) -> tuple[Float[np.ndarray, " 10"], str]:
    """Return the inertial parameters and, in words, the principal moments of an <inertial>."""
    mass_element, inertia_element = inertial.find("mass"), inertial.find("inertia")
    if mass_element is None or inertia_element is None:
        raise ModelError(f"{where}: <inertial> of link '{link}' needs both <mass> and <inertia>. Add what is missing.")
    mass = _number(mass_element, "value", f"mass of link '{link}'", where)
    if mass <= 0.0:
        raise ModelError(f"{where}: link '{link}' weighs {mass} kg; it must be positive. Weigh it or ask its maker.")
    xx, yy, zz, xy, xz, yz = (
        _number(inertia_element, key, f"inertia of link '{link}'", where)
        for key in ("ixx", "iyy", "izz", "ixy", "ixz", "iyz")
    )
    R, com = origin_of(inertial, f"<inertial> of link '{link}'", where)
    inertia = R @ np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]) @ R.T
    return inertial_parameters(mass, com, inertia), ", ".join(f"{m:.6g}" for m in np.linalg.eigvalsh(inertia))


def _moved(phi: Float[np.ndarray, " 10"], R: Matrix, p: Vector) -> Float[np.ndarray, " 10"]:
    """Parameters of the same body about another origin; R, p is the pose of its frame there."""
    mass = phi[0]
    com = phi[1:4] / mass
    about_com = inertia_about_origin(phi) - mass * (com @ com * np.eye(3) - np.outer(com, com))
    return inertial_parameters(mass, p + R @ com, R @ about_com @ R.T)


def _limits(joint: ElementTree.Element, name: str, kind: str, where: str) -> tuple[float, float, float, float]:
    limit = joint.find("limit")
    if limit is None:
        raise ModelError(f"{where}: joint '{name}' has no <limit>. Give effort and velocity, and lower and upper.")
    label = f"limit of joint '{name}'"
    effort, velocity = (_number(limit, key, label, where) for key in ("effort", "velocity"))
    if effort <= 0.0 or velocity <= 0.0:
        raise ModelError(
            f"{where}: {label}: effort {effort} and velocity {velocity} must be positive. Give the drive's ratings."
        )
    if kind == "continuous":
        return -math.inf, math.inf, effort, velocity
    lower, upper = (_number(limit, key, label, where) for key in ("lower", "upper"))
    if lower >= upper:
        raise ModelError(f"{where}: {label}: lower {lower} must be below upper {upper}. Are they swapped?")
    if kind == "revolute" and max(abs(lower), abs(upper)) > 4 * math.pi:
        raise ModelError(f"{where}: {label}: {lower} to {upper} rad is more than two turns. Are these degrees?")
    return lower, upper, effort, velocity


def _axis(joint: ElementTree.Element, name: str, where: str) -> Vector:
    element = joint.find("axis")
    axis = np.array([1.0, 0.0, 0.0]) if element is None else vector_of(element, "xyz", f"axis of joint '{name}'", where)
    length = float(np.linalg.norm(axis))
    if not 0.99 < length < 1.01:
        raise ModelError(f"{where}: axis of joint '{name}' has length {length:.4g}; it must be 1. Normalise it.")
    return axis / length


def origin_of(element: ElementTree.Element, label: str, where: str) -> tuple[Matrix, Vector]:
    """Rotation and position [m] of the `<origin>` of an element, in its parent.

    Raises:
        ModelError: A number is not valid.
    """
    origin = element.find("origin")
    if origin is None:
        return np.eye(3), np.zeros(3)
    p = vector_of(origin, "xyz", f"origin of {label}", where) if "xyz" in origin.attrib else np.zeros(3)
    rpy = vector_of(origin, "rpy", f"origin of {label}", where) if "rpy" in origin.attrib else np.zeros(3)
    return _rotation_rpy(rpy), p


def _rotation_rpy(rpy: Vector) -> Matrix:
    """Rotation matrix from URDF's fixed-axis roll, pitch, yaw [rad]."""
    (cr, cp, cy), (sr, sp, sy) = np.cos(rpy), np.sin(rpy)
    return np.array(
        [
            [cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr],
            [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr],
            [-sp, cp * sr, cp * cr],
        ]
    )


def _name(element: ElementTree.Element, where: str) -> str:
    name = element.get("name")
    if not name:
        raise ModelError(f"{where}: a <{element.tag}> has no name. Give it one.")
    return name


def _end(joint: ElementTree.Element, end: str, name: str, where: str) -> str:
    element = joint.find(end)
    if element is None or not element.get("link"):
        raise ModelError(f"{where}: joint '{name}' has no <{end} link=…>. Add it.")
    return element.get("link", "")


def _number(element: ElementTree.Element, key: str, label: str, where: str) -> float:
    text = element.get(key)
    value = _plain_number(text or "")
    if math.isnan(value):
        raise ModelError(
            f"{where}: {label}: {key} is {text!r}; a number between ±{NUMBER_MAX:g} is needed. Correct it, in SI units."
        )
    return value


def vector_of(element: ElementTree.Element, key: str, label: str, where: str) -> Vector:
    """Three numbers of an attribute.

    Raises:
        ModelError: The attribute does not hold three numbers.
    """
    text = element.get(key, "")
    values = np.array([_plain_number(part) for part in text.split()])
    if values.shape != (3,) or np.isnan(values).any():
        raise ModelError(
            f"{where}: {label}: {key} is {text!r}; three numbers between ±{NUMBER_MAX:g} are needed. Correct them."
        )
    return values


def _plain_number(text: str) -> float:
    """Convert text to a number; NaN for words, infinities and Python's digit groups, which read 1_68 as 168."""
    try:
        value = math.nan if "_" in text else float(text)
    except ValueError:
        return math.nan
    return value if abs(value) <= NUMBER_MAX else math.nan
