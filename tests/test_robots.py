"""The machines that come with exograv are whole, physical and the same on both sides."""

import re
import xml.etree.ElementTree as ElementTree
from pathlib import Path

import numpy as np
import pytest

from exograv.model.description import RigDescription, Side, load_rig, rig_names

RIGS = rig_names()
SIDES: tuple[Side, Side] = ("right", "left")
MIRROR = np.diag([1.0, -1.0, 1.0])
"""Reflection on the xz plane: what it does to positions; a pseudo-vector gets the opposite sign."""

PAGE = Path(__file__).parents[1] / "docs" / "robots.md"


def urdf(rig: str, side: Side) -> ElementTree.Element:
    return ElementTree.parse(load_rig(rig, side).urdf_path).getroot()


def vector(element: ElementTree.Element | None, attribute: str = "xyz") -> np.ndarray:
    assert element is not None
    return np.array([float(number) for number in element.attrib[attribute].split()])


def parts(root: ElementTree.Element, kind: str) -> dict[str, ElementTree.Element]:
    """Links, joints or inertials by the name of their link or joint."""
    if kind == "inertial":
        return {link.attrib["name"]: found for link in root.iter("link") if (found := link.find(kind)) is not None}
    return {element.attrib["name"]: element for element in root.findall(kind)}


def pairs(rig: str, kind: str) -> list[tuple[ElementTree.Element, ElementTree.Element]]:
    right, left = (parts(urdf(rig, side), kind) for side in SIDES)
    assert right
    assert list(right) == list(left)
    return [(right[name], left[name]) for name in right]


def mass(inertial: ElementTree.Element) -> float:
    return float(inertial.find("mass").attrib["value"])  # pyright: ignore[reportOptionalMemberAccess]


def inertia(inertial: ElementTree.Element) -> np.ndarray:
    values = inertial.find("inertia").attrib  # pyright: ignore[reportOptionalMemberAccess]
    return np.array([[float(values["i" + "".join(sorted(row + column))]) for column in "xyz"] for row in "xyz"])


@pytest.mark.parametrize("rig", RIGS)
def test_every_position_of_the_left_side_is_the_mirrored_one_of_the_right(rig: str):
    for kind in ("joint", "inertial"):
        for right, left in pairs(rig, kind):
            np.testing.assert_array_equal(vector(left.find("origin")), MIRROR @ vector(right.find("origin")))


@pytest.mark.parametrize("rig", RIGS)
def test_every_frame_of_both_sides_is_parallel_to_the_base(rig: str):
    for kind in ("joint", "inertial"):
        for element in (element for pair in pairs(rig, kind) for element in pair):
            assert not vector(element.find("origin"), "rpy").any()


@pytest.mark.parametrize("rig", RIGS)
def test_every_axis_is_mirrored_as_a_pseudo_vector(rig: str):
    moving = [pair for pair in pairs(rig, "joint") if pair[0].attrib["type"] != "fixed"]
    assert moving
    for right, left in moving:
        np.testing.assert_array_equal(vector(left.find("axis")), -MIRROR @ vector(right.find("axis")))


@pytest.mark.parametrize("rig", RIGS)
def test_tree_types_and_limits_are_the_same_on_both_sides(rig: str):
    for right, left in pairs(rig, "joint"):
        assert right.attrib == left.attrib
        for tag in ("parent", "child", "limit"):
            ours, others = right.find(tag), left.find(tag)
            assert (ours is None) == (others is None)
            if ours is not None and others is not None:
                assert ours.attrib == others.attrib


@pytest.mark.parametrize("rig", RIGS)
def test_masses_are_equal_and_inertias_mirrored(rig: str):
    for right, left in pairs(rig, "inertial"):
        assert mass(left) == mass(right)
        np.testing.assert_array_equal(inertia(left), MIRROR @ inertia(right) @ MIRROR)


@pytest.mark.parametrize("side", SIDES)
@pytest.mark.parametrize("rig", RIGS)
def test_every_inertia_could_belong_to_a_body(rig: str, side: Side):
    for inertial in parts(urdf(rig, side), "inertial").values():
        moments = np.linalg.eigvalsh(inertia(inertial))
        assert moments[0] > 0.0
        assert moments[0] + moments[1] >= moments[2]


def frames_named(description: RigDescription) -> set[str]:
    settings = description.settings
    centres = (description.shoulder_centre(side) for side in description.arm_sides)
    return {*centres, *description.mounts, *(cuff.exo_frame for cuff in settings.cuffs)}


@pytest.mark.parametrize("side", SIDES)
@pytest.mark.parametrize("rig", RIGS)
def test_every_frame_and_joint_of_the_rig_file_is_in_the_urdf(rig: str, side: Side):
    description, root = load_rig(rig, side), urdf(rig, side)
    joints = {*description.joints, *(adjustment.joint for adjustment in description.settings.adjustments)}
    assert frames_named(description) <= parts(root, "link").keys()
    assert joints <= parts(root, "joint").keys()


@pytest.mark.parametrize("rig", RIGS)
def test_a_drive_gives_no_more_than_the_effort_limit_of_its_joint(rig: str):
    joints = parts(urdf(rig, "right"), "joint")
    for actuator in load_rig(rig).settings.actuators:
        limit = joints[actuator.joint].find("limit")
        assert limit is not None
        assert actuator.torque_max_Nm is None or actuator.torque_max_Nm <= float(limit.attrib["effort"])


def test_the_documented_links_are_those_of_the_urdf():
    page = PAGE.read_text(encoding="utf-8").replace("−", "-")
    rows = re.findall(r"^\| `(\w+)` \| ([\d.]+) \| ([-\d. ]+) \|", page, flags=re.MULTILINE)
    documented = {name: (float(kg), [float(x) for x in centre.split()]) for name, kg, centre in rows}
    inertials = parts(urdf("recupera_like", "right"), "inertial")
    assert documented == {name: (mass(i), vector(i.find("origin")).tolist()) for name, i in inertials.items()}
