"""Links and joints of a URDF by name, as elements that can be changed."""

import xml.etree.ElementTree as ElementTree
from collections.abc import Iterator

import numpy as np

from exograv.model.tree import Vector
from exograv.model.urdf import origin_of


class Links:
    """Tree of the elements of a URDF."""

    def __init__(self, robot: ElementTree.Element):
        self.links = {link.get("name", ""): link for link in robot.findall("link")}
        self.joints = {joint.get("name", ""): joint for joint in robot.findall("joint")}
        self.above = {child_of(joint): name for name, joint in self.joints.items()}
        """Joint above each link."""
        self.root = next((link for link in self.links if link not in self.above), "")

    def below(self, link: str) -> Iterator[str]:
        """Yield the joints on a link."""
        return (name for name, joint in self.joints.items() if parent_of(joint) == link)

    def subtree(self, link: str) -> list[str]:
        """Return the link and all links behind it."""
        found, pending = [], [link]
        while pending:
            found.append(pending.pop())
            pending += [child_of(self.joints[name]) for name in self.below(found[-1])]
        return found

    def chain(self, joint: str) -> list[str]:
        """Return the joints from the root to this joint, which is the last."""
        found = [joint]
        while (parent := parent_of(self.joints[found[0]])) in self.above:
            found.insert(0, self.above[parent])
        return found

    def place(self, joint: str) -> Vector:
        """Position of the joint's origin in the root link, with all joints at zero [m]."""
        R, p = np.eye(3), np.zeros(3)
        for name in self.chain(joint):
            R_own, p_own = origin_of(self.joints[name], f"joint '{name}'", "")
            R, p = R @ R_own, p + R @ p_own
        return p


def parent_of(joint: ElementTree.Element) -> str:
    """Name of the link that carries the joint."""
    return _end(joint, "parent")


def child_of(joint: ElementTree.Element) -> str:
    """Name of the link that the joint moves."""
    return _end(joint, "child")


def mass_of(link: ElementTree.Element) -> float:
    """Mass of a link [kg]; zero without an inertial."""
    mass = link.find("inertial/mass")
    return 0.0 if mass is None else float(mass.get("value", "0"))


def _end(joint: ElementTree.Element, end: str) -> str:
    element = joint.find(end)
    return "" if element is None else element.get("link", "")
