"""Frames that a stranger's file does not have: shoulder centre, cuffs with z along the limb, and place of weights."""

import xml.etree.ElementTree as ElementTree

import numpy as np

from exograv.model.tree import Matrix, Tree, Vector
from exograv.model.urdf_inference import PLACED, ArmGuess

from .fixing import set_origin
from .geometry import ArmGeometry, Pose, arm_geometry
from .links import Links

CUFF_SHARE, FOREARM_M, HAND_M = 0.55, 0.17, 0.06
"""Places of added cuffs: share of the upper arm from the shoulder, and distances from elbow and last wrist axis [m].
Assumed, as in recupera_like."""
BRACKET_M = 0.08
"""Distance of the wrist's weights from the forearm's axis [m], as a bracket beside it; a weight on the axis loads
nothing."""


def add_frames(robot: ElementTree.Element, tree: Tree, arms: list[ArmGuess]) -> list[str]:
    """Add the frames that are missing to the URDF. Return a sentence for each."""
    notes = []
    for arm in arms:
        geometry = arm_geometry(tree, arm)
        if geometry is not None:
            notes += _Adding(robot, tree, arm, geometry).frames()
    return notes


class _Adding:
    """Addition of frames to the file, for one arm."""

    def __init__(self, robot: ElementTree.Element, tree: Tree, arm: ArmGuess, geometry: ArmGeometry):
        self._robot, self._tree, self._arm, self._at = robot, tree, arm, geometry
        self._links = Links(robot)
        self._notes: list[str] = []
        self._prefix = f"{PLACED}{arm.side}_" if arm.side else PLACED

    def frames(self) -> list[str]:
        arm, at = self._arm, self._at
        if arm.shoulder_centre is None and at.carrier < 0:
            self._add("shoulder_centre", -1, np.eye(3), at.shoulder, "the elbow's axis, assumed")
        elif arm.shoulder_centre is None and arm.meeting is not None:
            self._add("shoulder_centre", -1, np.eye(3), arm.meeting, arm.meets)
        beyond = [i for i, guess in zip(arm.joints, arm.places, strict=True) if guess.place == "wrist"]
        wanted = 3 if len(beyond) > 1 else 2
        R_forearm = _along(at.forearm, at.axis_in_body)
        if len(arm.cuffs) != wanted:
            share = at.shoulder + CUFF_SHARE * (at.elbow - at.shoulder)
            self._add("upper_arm_cuff", at.carrier, _along(at.upper_arm, at.axis), share, "on the upper arm")
            place = at.elbow_in_body + FOREARM_M * at.forearm
            body = beyond[0] if beyond else at.elbow_body
            self._add("forearm_cuff", body, *self._seen_from(body, R_forearm, place), "on the forearm")
            if wanted == 3:
                R = self._seen_from(beyond[-1], R_forearm, place)[0]
                self._add("hand_cuff", beyond[-1], R, -R[:, 2] * HAND_M, "in the hand")
        if beyond:
            R = self._seen_from(beyond[-1], R_forearm, at.elbow_in_body)[0]
            bracket = BRACKET_M * R[:, 0] - HAND_M * R[:, 2]
            self._add("wrist_mount", beyond[-1], np.eye(3), bracket, "80 mm beside the forearm's axis, for weights")
        return self._notes

    def _seen_from(self, body: int, R: Matrix, p: Vector) -> tuple[Matrix, Vector]:
        """Pose of a frame of the elbow's body in another body, at the zero posture."""
        poses, zero = Pose(self._tree), np.zeros(len(self._tree.joints))
        (R_e, p_e), (R_b, p_b) = poses(zero, self._at.elbow_body), poses(zero, body)
        return R_b.T @ R_e @ R, R_b.T @ (R_e @ p + p_e - p_b)

    def _add(self, name: str, body: int, R: Matrix, p: Vector, where: str) -> None:
        link, carrier = self._prefix + name, self._links.root if body < 0 else self._tree.bodies[body]
        if link in self._links.links:
            return
        ElementTree.SubElement(self._robot, "link", name=link)
        joint = ElementTree.SubElement(self._robot, "joint", name=f"{link}_mount", type="fixed")
        ElementTree.SubElement(joint, "parent", link=carrier)
        ElementTree.SubElement(joint, "child", link=link)
        set_origin(joint, R, p)
        self._notes.append(f"Added link {link} {where}: at {p[0]:.3f} {p[1]:.3f} {p[2]:.3f} m in {carrier}.")


def _along(limb: Vector, across: Vector) -> Matrix:
    """Rotation of a cuff: z along the limb towards the shoulder, y along the elbow's axis."""
    return np.column_stack([np.cross(across, -limb), across, -limb])


def carry_by_body(robot: ElementTree.Element, tree: Tree, name: str) -> None:
    """Attach a joint to the link of its moving body, so that a length can be set along one axis of its parent."""
    links = Links(robot)
    joint = tree.joints[tree.index(name)]
    element = links.joints[name]
    carrier = links.root if joint.parent < 0 else tree.bodies[joint.parent]
    parent = element.find("parent")
    if parent is not None and parent.get("link") != carrier:
        parent.set("link", carrier)
        set_origin(element, joint.R_parent_joint, joint.p_parent_joint)


def base_at_shoulder(robot: ElementTree.Element, shoulder: Vector) -> None:
    """Add a root link at the shoulder, so that a machine without shoulder can be set to the upper arm's length."""
    links = Links(robot)
    root, link = links.root, f"{PLACED}shoulder_centre"
    robot.insert(0, ElementTree.Element("link", name=link))
    mount = ElementTree.SubElement(robot, "joint", name=f"{link}_mount", type="fixed")
    ElementTree.SubElement(mount, "parent", link=link)
    ElementTree.SubElement(mount, "child", link=root)
    set_origin(mount, np.eye(3), -shoulder)
