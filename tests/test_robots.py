"""The supplied machines are complete, physical, equal on both sides, and fit the arm they are for."""

import re
import xml.etree.ElementTree as ElementTree
from pathlib import Path

import casadi as ca
import numpy as np
import pytest

from exograv.model.anthropometry import Body
from exograv.model.assembly import Assembly, adjusted, read_exoskeleton
from exograv.model.description import RigDescription, load_rig, rig_names
from exograv.model.kinematics import body_poses
from exograv.model.loops import LoopSolver
from exograv.model.support import assemble, sample_postures
from exograv.options import Side
from exograv.spatial import Transform

RIGS = rig_names()
MACHINES = [(rig, side) for rig in RIGS for side in load_rig(rig).settings.urdf.sides]
PAIRS = [rig for rig in RIGS if load_rig(rig).settings.urdf.sides == ("right", "left")]
MIRROR = np.diag([1.0, -1.0, 1.0])
"""Reflection on the xz plane, applied to positions; a pseudo-vector gets the opposite sign."""

PAGE = Path(__file__).parents[1] / "docs" / "reference" / "robots.md"
WEARER = Body(1.75, 75.0, "male")
ALIGNED_M = 1e-6
"""Tolerance of alignment [m]: arm angles at donning have four decimals, and 0.25 m × 1e-4° is half a micrometre."""


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
    right, left = (parts(urdf(rig, side), kind) for side in ("right", "left"))
    assert right
    assert list(right) == list(left)
    return [(right[name], left[name]) for name in right]


def mass(inertial: ElementTree.Element) -> float:
    return float(inertial.find("mass").attrib["value"])  # pyright: ignore[reportOptionalMemberAccess]


def inertia(inertial: ElementTree.Element) -> np.ndarray:
    values = inertial.find("inertia").attrib  # pyright: ignore[reportOptionalMemberAccess]
    return np.array([[float(values["i" + "".join(sorted(row + column))]) for column in "xyz"] for row in "xyz"])


def poses(tree, q: np.ndarray) -> list[Transform]:
    """Return the poses of the bodies as numbers."""
    return body_poses(tree, ca.SX(ca.DM(q)))


def number(expression: ca.SX) -> np.ndarray:
    return np.array(ca.evalf(expression))


def put_in(rig: str, side: Side) -> Assembly:
    return assemble(load_rig(rig, side), WEARER)


@pytest.mark.parametrize("rig", PAIRS)
def test_every_position_of_the_left_side_is_the_mirrored_one_of_the_right(rig: str):
    for kind in ("joint", "inertial"):
        for right, left in pairs(rig, kind):
            np.testing.assert_array_equal(vector(left.find("origin")), MIRROR @ vector(right.find("origin")))


@pytest.mark.parametrize("rig", PAIRS)
def test_every_frame_of_both_sides_is_parallel_to_the_base(rig: str):
    for kind in ("joint", "inertial"):
        for element in (element for pair in pairs(rig, kind) for element in pair):
            assert not vector(element.find("origin"), "rpy").any()


@pytest.mark.parametrize("rig", PAIRS)
def test_every_axis_is_mirrored_as_a_pseudo_vector(rig: str):
    moving = [pair for pair in pairs(rig, "joint") if pair[0].attrib["type"] != "fixed"]
    assert moving
    for right, left in moving:
        np.testing.assert_array_equal(vector(left.find("axis")), -MIRROR @ vector(right.find("axis")))


@pytest.mark.parametrize("rig", PAIRS)
def test_tree_types_and_limits_are_the_same_on_both_sides(rig: str):
    for right, left in pairs(rig, "joint"):
        assert right.attrib == left.attrib
        for tag in ("parent", "child", "limit"):
            ours, others = right.find(tag), left.find(tag)
            assert (ours is None) == (others is None)
            if ours is not None and others is not None:
                assert ours.attrib == others.attrib


@pytest.mark.parametrize("rig", PAIRS)
def test_masses_are_equal_and_inertias_mirrored(rig: str):
    for right, left in pairs(rig, "inertial"):
        assert mass(left) == mass(right)
        np.testing.assert_array_equal(inertia(left), MIRROR @ inertia(right) @ MIRROR)


@pytest.mark.parametrize(("rig", "side"), MACHINES)
def test_every_inertia_could_belong_to_a_body(rig: str, side: Side):
    for inertial in parts(urdf(rig, side), "inertial").values():
        moments = np.linalg.eigvalsh(inertia(inertial))
        assert moments[0] > 0.0
        assert moments[0] + moments[1] >= moments[2]


def frames_named(description: RigDescription) -> set[str]:
    centres = (description.shoulder_centre(side) for side in description.arm_sides)
    return {*centres, *description.mounts, *(cuff.exo_frame for cuff in description.settings.cuffs)}


@pytest.mark.parametrize(("rig", "side"), MACHINES)
def test_every_frame_and_joint_of_the_rig_file_is_in_the_urdf(rig: str, side: Side):
    description, root = load_rig(rig, side), urdf(rig, side)
    joints = {*description.joints, *(adjustment.joint for adjustment in description.settings.adjustments)}
    assert frames_named(description) <= parts(root, "link").keys()
    assert joints <= parts(root, "joint").keys()


@pytest.mark.parametrize(("rig", "side"), MACHINES)
def test_a_drive_gives_no_more_than_the_effort_limit_of_its_joint(rig: str, side: Side):
    joints = parts(urdf(rig, side), "joint")
    for actuator in load_rig(rig).settings.actuators:
        limit = joints[actuator.joint].find("limit")
        assert limit is not None
        assert actuator.torque_max_Nm is None or actuator.torque_max_Nm <= float(limit.attrib["effort"])


@pytest.mark.parametrize(("rig", "side"), MACHINES)
def test_a_nominal_length_is_that_of_the_urdf(rig: str, side: Side):
    tree = read_exoskeleton(load_rig(rig, side))
    for adjustment in load_rig(rig).settings.adjustments:
        place = tree.joints[tree.index(adjustment.joint)].p_parent_joint
        assert abs(place["xyz".index(adjustment.axis)]) == adjustment.nominal_m


# An arm fastened without strain in one posture stays free of strain in all postures only if the shoulder axes meet in
# the shoulder's centre and the axes of elbow and wrist are the arm's own: then arm and machine coincide.
@pytest.mark.parametrize(("rig", "side"), MACHINES)
def test_an_arm_of_the_right_length_follows_through_the_task_workspace_without_any_strain(rig: str, side: Side):
    assembly = put_in(rig, side)
    solver = LoopSolver(assembly)
    donned = assembly.description.arm_donning_posture
    for y in sample_postures(assembly.description, 8):
        z, slope = solver.solve(y)
        assert slope < 1e-8
        assert solver.strain(y, z)[0] < ALIGNED_M
    np.testing.assert_allclose(solver.solve(assembly.description.donning_posture)[0], donned, atol=1e-9)


@pytest.mark.parametrize(("rig", "side"), MACHINES)
def test_the_postures_that_the_rig_file_names_are_within_the_limits(rig: str, side: Side):
    description = load_rig(rig, side)
    joints = read_exoskeleton(description).joints
    lower, upper = (np.rad2deg([getattr(joint, end) for joint in joints]) for end in ("lower", "upper"))
    settings = description.settings
    postures = [settings.donning.posture_deg, settings.task_workspace.lower_deg, settings.task_workspace.upper_deg]
    for sweep in settings.sweeps:
        moving = description.joints.index(sweep.joint)
        ends = (sweep.from_deg, sweep.to_deg)
        postures += [[end if k == moving else p for k, p in enumerate(sweep.posture_deg)] for end in ends]
    for posture in postures:
        assert (lower <= posture).all()
        assert (posture <= upper).all()


KIN = {"recupera_like_passive": "", "recupera_like_7": "", "recupera_like_dual": "right_"}
"""Machines that share the shoulder and elbow of recupera_like, with the prefix of their names."""


@pytest.mark.parametrize("rig", KIN)
def test_what_is_made_from_recupera_like_has_its_shoulder_and_elbow(rig: str):
    ours, others = (parts(urdf(name, load_rig(name).side), "joint") for name in ("recupera_like", rig))
    for name in load_rig("recupera_like").joints:
        joint = others[KIN[rig] + name]
        for tag, attribute in (("origin", "xyz"), ("axis", "xyz"), ("limit", "lower"), ("limit", "upper")):
            assert joint.find(tag).attrib[attribute] == ours[name].find(tag).attrib[attribute]  # pyright: ignore[reportOptionalMemberAccess]


def words(element: ElementTree.Element, without: str = "") -> list[str]:
    """Return an element's text without spaces and without a prefix."""
    return ElementTree.tostring(element).decode().replace(f'="{without}', '="').split()


def test_each_arm_of_the_dual_machine_is_recupera_like_of_that_side():
    both = {kind: parts(urdf("recupera_like_dual", "both"), kind) for kind in ("inertial", "joint")}
    sides: tuple[Side, ...] = ("right", "left")
    for side in sides:
        for kind, elements in both.items():
            for name, single in parts(urdf("recupera_like", side), kind).items():
                assert words(elements[f"{side}_{name}"], without=f"{side}_") == words(single)


def test_a_quasi_direct_drive_turns_more_easily_than_a_harmonic_one():
    for ours, others in zip(
        *(load_rig(rig).settings.actuators for rig in ("recupera_like_qdd", "recupera_like")), strict=True
    ):
        assert ours.gear_ratio < others.gear_ratio / 10  # pyright: ignore[reportOptionalOperand, reportOperatorIssue]
        assert ours.rotor_inertia_kgm2 < others.rotor_inertia_kgm2 / 5  # pyright: ignore[reportOptionalOperand, reportOperatorIssue]


def test_without_motors_the_machine_is_lighter():
    light, heavy = (
        sum(mass(inertial) for inertial in parts(urdf(rig, "right"), "inertial").values())
        for rig in ("recupera_like_passive", "recupera_like")
    )
    assert light < 0.6 * heavy


@pytest.mark.parametrize(("rig", "side"), MACHINES)
def test_a_longer_upper_arm_moves_the_machines_elbow_as_far(rig: str, side: Side):
    description = load_rig(rig, side)
    tree = read_exoskeleton(description)
    lengths = {"upper_arm": 0.27, "forearm": 0.24}
    elbow = next(i for i, place in enumerate(description.places) if place == "elbow")
    shoulder = tree.frame(description.shoulder_centre(description.arm_sides[0])).p_body_frame
    for q in sample_postures(description, 2):
        place = number(poses(adjusted(tree, description, lengths), q)[elbow].p).ravel()
        assert np.linalg.norm(place - shoulder) == pytest.approx(lengths["upper_arm"], abs=1e-12)


def test_the_documented_links_are_those_of_the_urdf():
    page = PAGE.read_text(encoding="utf-8").replace("−", "-")
    page = page[page.index("## recupera_like\n") : page.index("## The other machines")]
    rows = re.findall(r"^\| `(\w+)` \| ([\d.]+) \| ([-\d. ]+) \|", page, flags=re.MULTILINE)
    documented = {name: (float(kg), [float(x) for x in centre.split()]) for name, kg, centre in rows}
    inertials = parts(urdf("recupera_like", "right"), "inertial")
    assert documented == {name: (mass(i), vector(i.find("origin")).tolist()) for name, i in inertials.items()}
