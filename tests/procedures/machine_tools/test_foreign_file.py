"""Foreign files: exograv rig new takes any machine's file, leaves out what moves no arm, and says so."""

import re
import tomllib
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from tests.foreign_machines import (
    ELBOW,
    ELBOW_AND_ROLL,
    FOUR,
    NAMES,
    NUMBERS,
    ONE_JOINT,
    TWO_JOINTS,
    answered,
    arm,
    joint,
    link,
    robot,
    written,
)

from exograv.errors import ConfigError, ModelError
from exograv.model.assembly import read_exoskeleton
from exograv.model.description import load_rig
from exograv.model.rig_settings import written_out
from exograv.model.tree import Tree
from exograv.model.urdf import read_urdf
from exograv.motion import fourier
from exograv.procedures.machine_tools.check_rig import check_rig
from exograv.procedures.machine_tools.design_motion import motion_note, write_excitation
from exograv.procedures.machine_tools.new_rig import NewRig, new_rig
from exograv.procedures.machine_tools.options import CheckOptions, NewRigOptions

LEFT = ("left_sh_flex", "left_sh_abd", "left_sh_rot", "left_elbow")
HUMAN = [
    link("human_upper_arm", 2.1, "0 0 -0.14"),
    joint("mount_1", ("c_right_elbow", "human_upper_arm"), "0 0 0", "0 0 1", kind="fixed"),
    link("human_forearm", 1.65, "0 0 -0.12"),
    joint("mount_2", ("d_right_elbow", "human_forearm"), "0 0 0", "0 0 1", kind="fixed"),
]
ONE_ARM = robot("exo", link("base"), arm("base", NAMES))


def legs(side: str, y: float) -> str:
    return "\n".join(
        [
            link(f"{side}_thigh", 3.0, "0 0 -0.2"),
            joint(f"{side}_hip_flexion", ("pelvis", f"{side}_thigh"), f"0 {y} 0", "0 -1 0", "-0.5 1.8 90 5"),
            link(f"{side}_shank", 2.0, "0 0 -0.2"),
            joint(f"{side}_knee", (f"{side}_thigh", f"{side}_shank"), "0 0 -0.42", "0 1 0", "0 2 90 5"),
            link(f"{side}_foot", 1.0, "0.05 0 0"),
            joint(f"{side}_ankle", (f"{side}_shank", f"{side}_foot"), "0 0 -0.42", "0 1 0", "-0.6 0.6 60 5"),
        ]
    )


WHOLE_BODY = robot(
    "whole_body_exo",
    link("pelvis", 9.0),
    link("torso", 6.0),
    joint("waist_yaw", ("pelvis", "torso"), "0 0 0.9", "0 0 1", "-0.5 0.5 80 2"),
    arm("torso", NAMES),
    arm("torso", LEFT, y=0.2),
    legs("right", -0.1),
    legs("left", 0.1),
)


def new(folder: Path, text: str, name: str = "machine.urdf", **options: Any) -> NewRig:
    return new_rig(NewRigOptions(written(folder, text, name), folder / "mine", **options))


def tree_of(folder: Path) -> Tree:
    """Return the tree of a folder whose questions are answered."""
    return read_exoskeleton(load_rig(str(folder)))


def data_of(found: NewRig) -> dict[str, Any]:
    return tomllib.loads((found.folder / "rig.toml").read_text(encoding="utf-8"))


@pytest.mark.parametrize(
    ("text", "answers", "most"),
    [(ONE_JOINT, ELBOW, 8), (TWO_JOINTS, ELBOW_AND_ROLL, 8), (ONE_ARM, FOUR, 10), (WHOLE_BODY, FOUR, 10)],
    ids=["elbow", "elbow and forearm", "four joints", "whole body"],
)
@pytest.mark.usefixtures("without_picture")
def test_a_foreign_machine_has_no_problem_after_few_answers(
    text: str, answers: dict[str, list[str]], most: int, tmp_path: Path
):
    found = new(tmp_path, text, side="right")
    assert len(found.questions) <= most
    answered(found.folder, answers)
    result = check_rig(CheckOptions(str(found.folder)), tmp_path, lambda _text, _share: None)
    assert result.problems == []
    assert result.torque_Nm is not None
    assert result.rank == result.human_dof


@pytest.mark.usefixtures("without_picture")
def test_the_only_joint_is_said_to_be_taken_as_the_elbow_if_its_name_tells_nothing(tmp_path: Path):
    found = new(tmp_path, ONE_JOINT.replace('"elbow"', '"m1"').replace("elbow_orthosis", "machine_7"), side="right")
    assert any("The only joint, m1, is taken as the elbow" in note for note in found.notes)
    assert len(found.questions) <= 8
    answered(found.folder, ELBOW)
    assert check_rig(CheckOptions(str(found.folder)), tmp_path, lambda _text, _share: None).problems == []


@pytest.mark.parametrize(("text", "names"), [(ONE_JOINT, ("wrist",)), (TWO_JOINTS, ("m1", "m2"))])
def test_fewer_than_three_axes_are_not_said_to_be_the_first_three(text: str, names: tuple[str, ...], tmp_path: Path):
    for old, new_name in zip(("elbow", "right_pronation_joint"), names, strict=False):
        text = text.replace(f'"{old}"', f'"{new_name}"').replace(f'"right_{old}_joint"', f'"{new_name}"')
    found = new(tmp_path, text, side="right")
    comments = {question.key: question.comment for question in found.questions}
    assert "its axes do not show this point" in comments["wearer.shoulder_centre"]


def test_one_arm_of_a_two_armed_machine_with_legs_keeps_its_own_joints_only(tmp_path: Path):
    found = new(tmp_path, WHOLE_BODY, side="right")
    assert found.joints == NAMES
    said = "\n".join(found.notes)
    for name in ("right_knee", "left_hip_flexion", "left_elbow", "waist_yaw"):
        assert name in said
    urdf = (found.folder / "machine.urdf").read_text(encoding="utf-8")
    assert "shank" not in urdf
    assert "d_left_elbow" not in urdf


def test_both_arms_are_kept_if_no_side_is_asked_for(tmp_path: Path):
    assert new(tmp_path, WHOLE_BODY).joints == NAMES + LEFT


def test_arms_without_a_side_in_their_names_are_told_apart_by_their_place(tmp_path: Path):
    others = ("J5", "J6", "J7", "J8")
    text = robot("exo", link("base"), arm("base", NUMBERS), arm("base", others, y=0.2))
    assert new(tmp_path, text, side="left").joints == others


@pytest.mark.parametrize("side", [None, "both"])
def test_two_arms_without_a_side_in_the_names_of_their_joints_are_never_read_as_one(side: str | None, tmp_path: Path):
    text = robot("exo", link("base"), arm("base", NUMBERS), arm("base", ("J5", "J6", "J7", "J8"), y=0.2))
    with pytest.raises(ConfigError, match=r"two arms.* J1 to J4 is taken as the right arm and J5 to J8.*--side right"):
        new(tmp_path, text, side=side)
    with pytest.raises(ConfigError, match="two arms"):
        new(tmp_path, text, joints=("J1", "J2", "J3", "J4", "J5", "J6", "J7", "J8"))
    assert not (tmp_path / "mine").exists()


def test_two_arms_with_a_side_in_the_names_of_links_only_are_not_read_as_one(tmp_path: Path):
    text = WHOLE_BODY
    for number, name in enumerate(NAMES + LEFT):
        text = text.replace(f'<joint name="{name}"', f'<joint name="J{number + 1}"')
    with pytest.raises(ConfigError, match=r"J1 to J4 is taken as the right arm and J5 to J8 as the left"):
        new(tmp_path, text)
    assert new(tmp_path, text, side="left").joints == ("J5", "J6", "J7", "J8")


@pytest.mark.parametrize("side", [None, "right"])
def test_two_equal_chains_on_one_side_are_asked_about(side: str | None, tmp_path: Path):
    others = ("J5", "J6", "J7", "J8")
    text = robot("exo", link("base"), arm("base", NUMBERS), arm("base", others, y=-0.3))
    with pytest.raises(ConfigError, match=r"2 chains of 4 joints that may be the arm: J1 to J4; J5 to J8.*--joints"):
        new(tmp_path, text, side=side)
    assert new(tmp_path, text, joints=others).joints == others


def test_slides_and_fingers_are_fixed_and_keep_their_weight(tmp_path: Path):
    limit = "-0.146 -0.02 300 0.1"
    text = robot(
        "exo_right",
        link("base"),
        link("carriage", 5.0),
        joint("lift", ("base", "carriage"), "0 0 1", "0 0 1", limit, kind="prismatic"),
        arm("carriage", NAMES),
        link("thumb_1", 0.02, "0 0 -0.02"),
        joint("thumb_mcp", ("d_right_elbow", "thumb_1"), "0 0 -0.3", "0 1 0", "0 1.5 1 2"),
        link("thumb_2", 0.01, "0 0 -0.02"),
        joint(
            "thumb_pip", ("thumb_1", "thumb_2"), "0 0 -0.04", "0 1 0", "0 1.5 1 2", more='<mimic joint="thumb_mcp"/>'
        ),
    )
    found = new(tmp_path, text)
    assert found.joints == NAMES
    assert "A slide: fixed lift at -20 mm." in found.notes
    assert any("thumb_mcp" in note for note in found.notes)
    answered(found.folder, FOUR)
    tree = tree_of(found.folder)
    assert tree.phi[3, 0] == pytest.approx(0.7 + 0.03)
    assert tree.joints[0].p_parent_joint == pytest.approx([0.0, -0.2, 1.48])


def test_a_joint_that_cannot_be_at_zero_is_fixed_at_its_nearest_limit(tmp_path: Path):
    names = ("right_pre", "right_sh_flex", "right_sh_abd", "right_sh_rot", "right_elbow")
    turned = joint(names[0], ("base", "yoke"), "0 0 0", "0.6 0 0.8", "0.3 1.0 10 1")
    text = robot("exo", link("base"), link("yoke", 1.0), turned, arm("yoke", NAMES))
    whole = read_urdf(written(tmp_path, text, "whole.urdf"))
    found = new(tmp_path, text, joints=NAMES)
    answered(found.folder, FOUR)
    fixed = tree_of(found.folder)
    c, s, axis = np.cos(0.3), np.sin(0.3), whole.joints[0].axis
    K = np.array([[0, -axis[2], axis[1]], [axis[2], 0, -axis[0]], [-axis[1], axis[0], 0]])
    R = np.eye(3) + s * K + (1 - c) * K @ K
    assert fixed.joints[0].p_parent_joint == pytest.approx(R @ whole.joints[1].p_parent_joint)
    assert fixed.joints[0].R_parent_joint == pytest.approx(R)


def test_links_of_a_human_arm_are_asked_about_with_their_mass(tmp_path: Path):
    text = robot("exo_right", link("base"), arm("base", NAMES), *HUMAN)
    with pytest.raises(ConfigError, match=r"3.75 kg together: human_upper_arm 2.1 kg, .*--wearer-links leave-out"):
        new(tmp_path, text)
    found = new(tmp_path, text, wearer_links="leave-out")
    answered(found.folder, FOUR)
    assert tree_of(found.folder).phi[:, 0].sum() == pytest.approx(2.0 + 1.6 + 1.2 + 0.7)


def test_bones_that_the_machines_joint_moves_are_asked_about(tmp_path: Path):
    bones = robot(
        "elbow_right",
        link("base"),
        link("r_humerus", 1.9, "0 0 -0.18"),
        joint("worn", ("base", "r_humerus"), "0 0 1.4", "0 0 1", kind="fixed"),
        link("r_ulna_radius_hand", 1.5, "0 0 -0.18"),
        joint("r_elbow_flex", ("r_humerus", "r_ulna_radius_hand"), "0 0 -0.29", "0 -1 0", "0 2.3 18 4"),
    )
    with pytest.raises(ConfigError, match=r"3.4 kg together: r_humerus 1.9 kg, r_ulna_radius_hand 1.5 kg"):
        new(tmp_path, bones)
    # Without the person this file has no machine.
    with pytest.raises(ModelError, match="link 'r_ulna_radius_hand' moves but has no <inertial>"):
        new(tmp_path, bones, wearer_links="leave-out")
    assert new(tmp_path, bones, wearer_links="keep").joints == ("r_elbow_flex",)


def test_heavy_links_without_a_telling_name_are_pointed_out_and_left_out_by_their_names(tmp_path: Path):
    unnamed = [part.replace("human_upper_arm", "body_17").replace("human_forearm", "body_18") for part in HUMAN]
    hand = joint("mount_3", ("body_18", "body_19"), "0 0 -0.27", "0 0 1", kind="fixed")
    text = robot("exo_right", link("base"), arm("base", NAMES), *unnamed, link("body_19", 0.4), hand)
    said = "\n".join(new(tmp_path, text).notes)
    assert "body_17 2.1 kg, body_18 1.65 kg, body_19 0.4 kg" in said
    assert "--wearer-links body_17,body_18,body_19:" in said
    options = NewRigOptions(tmp_path / "machine.urdf", tmp_path / "without", wearer_links="body_17,body_18,body_19")
    found = new_rig(options)
    assert "Left out as the wearer's, as answered: body_17 2.1 kg, body_18 1.65 kg, body_19 0.4 kg." in found.notes
    answered(found.folder, FOUR)
    assert tree_of(found.folder).phi[:, 0].sum() == pytest.approx(2.0 + 1.6 + 1.2 + 0.7)
    with pytest.raises(ConfigError, match=r"--wearer-links names nothing; allowed: leave-out, keep, or links"):
        new_rig(NewRigOptions(tmp_path / "machine.urdf", tmp_path / "other", wearer_links="body_17,nothing"))


@pytest.mark.parametrize(
    ("carrier", "name", "mass"),
    [("d_right_elbow", "elbow_motor", 1.5), ("d_right_elbow", "body", 0.6), ("b_right_elbow", "body", 1.5),
     ("base", "body", 9.0)],
)  # fmt: skip
def test_a_drive_a_light_link_one_lighter_than_its_carrier_and_a_stand_are_no_part_of_a_person(
    carrier: str, name: str, mass: float, tmp_path: Path
):
    mount = joint("mounting", (carrier, name), "0 0 0", "0 0 1", kind="fixed")
    text = robot("exo_right", link("base", 3.0), arm("base", NAMES), link(name, mass), mount)
    assert not any("--wearer-links" in note for note in new(tmp_path, text).notes)


def test_links_of_a_human_arm_stay_if_they_are_the_machines(tmp_path: Path):
    text = robot("exo_right", link("base"), arm("base", NAMES), *HUMAN)
    found = new(tmp_path, text, wearer_links="keep")
    answered(found.folder, FOUR)
    assert tree_of(found.folder).phi[:, 0].sum() == pytest.approx(5.5 + 3.75)


def test_missing_limits_are_asked_for_and_the_answers_are_the_machines_limits(tmp_path: Path):
    limits = {0: "", 1: "", 2: "-1.2 1.2 30 3", 3: "0 0 0 0"}
    found = new(tmp_path, robot("exo", link("base"), arm("base", NUMBERS, limits=limits)), side="right")
    keys = [question.key for question in found.questions]
    assert keys.count("actuators.range_deg") == 3
    assert len(keys) <= 15
    ranges = ["[-40.0, 130.0]", "[-15.0, 75.0]", "[0.0, 125.0]"]
    answered(found.folder, FOUR | {"actuators.range_deg": ranges})
    tree = tree_of(found.folder)
    assert np.rad2deg([one.upper for one in tree.joints]) == pytest.approx([130.0, 75.0, np.rad2deg(1.2), 125.0])
    assert [one.effort for one in tree.joints] == [40.0, 40.0, 30.0, 40.0]
    assert tree.joints[0].velocity == pytest.approx(np.deg2rad(170.0))
    assert tree.joints[2].velocity == 3.0


def test_a_four_joint_machine_without_limits_or_a_side_asks_at_most_fifteen_questions(tmp_path: Path):
    text = robot("exo", link("base"), arm("base", NUMBERS, limits=dict.fromkeys(range(4), "")))
    found = new(tmp_path, text)
    assert len(found.questions) <= 15
    assert "urdf.side" in [question.key for question in found.questions]
    asked = [question.comment for question in found.questions if question.key == "actuators.range_deg"]
    assert [name for name in NUMBERS for comment in asked if name in comment] == list(NUMBERS)
    ranges = ["[-40.0, 130.0]", "[-15.0, 75.0]", "[-70.0, 70.0]", "[0.0, 125.0]"]
    answered(found.folder, FOUR | {"actuators.range_deg": ranges})
    length = load_rig(str(found.folder)).settings.adjustments[0]
    assert (length.min_m, length.max_m) == (0.20, 0.37)


@pytest.mark.parametrize("wrong", ["[0.2]", "[0.2, 0.37]\nmin_m = 0.2", '"long"'])
def test_a_range_of_a_length_that_is_no_pair_or_is_stated_twice_is_refused(wrong: str, tmp_path: Path):
    found = new(tmp_path, ONE_ARM)
    answered(found.folder, FOUR | {"adjustments.range_m": [wrong]})
    with pytest.raises(ConfigError, match=r"it must be \[shortest, longest\], without min_m and max_m"):
        load_rig(str(found.folder))


def test_an_effort_or_a_speed_of_zero_is_asked_for_with_the_name_of_its_joint(tmp_path: Path):
    limits = {1: "-0.2 1.3 0 3", 2: "-1.2 1.2 30 0"}
    found = new(tmp_path, robot("exo", link("base"), arm("base", NUMBERS, limits=limits)), side="right")
    comments = {question.key: question.comment for question in found.questions}
    assert comments["drives.torque_max_Nm"].endswith("the URDF gives none for J2")
    assert comments["drives.speed_max_deg_s"].endswith("the URDF gives none for J3")


@settings(max_examples=30)
@given(lower=st.lists(st.floats(-170.0, 100.0), min_size=4, max_size=4), span=st.floats(2.0, 200.0))
def test_the_proposed_excitation_stays_within_limits_that_are_answered_later(
    lower: list[float], span: float, no_limits: str
):
    data = tomllib.loads(no_limits)
    for one, low in zip(data["actuators"], lower, strict=True):
        one["range_deg"] = [low, low + span]
    plan = written_out(data)["excitation"]
    centre, sine, cosine = (np.array(plan[key]) for key in ("centre_deg", "sine_deg", "cosine_deg"))
    q = fourier(centre, sine, cosine, 20.0, 20.0, 0.02).q
    assert (q >= np.array(lower) - 1e-9).all()
    assert (q <= np.array(lower) + span + 1e-9).all()
    assert np.ptp(q, axis=0).min() > 0.1 * min(span, 50.0)


@pytest.fixture(scope="module")
def no_limits(tmp_path_factory: pytest.TempPathFactory) -> str:
    """Rig file of a machine whose file gives no limits."""
    text = robot("exo", link("base"), arm("base", NUMBERS, limits=dict.fromkeys(range(4), "")))
    return (new(tmp_path_factory.mktemp("rig"), text, side="right").folder / "rig.toml").read_text(encoding="utf-8")


@pytest.mark.usefixtures("without_picture")
def test_an_excitation_beyond_the_limits_names_the_command_that_designs_another(tmp_path: Path):
    found = new(tmp_path, ONE_ARM)
    answered(found.folder, FOUR)
    path = found.folder / "rig.toml"
    text = path.read_text(encoding="utf-8")
    path.write_text(re.sub(r"\ncentre_deg = \[[^,]*", "\ncentre_deg = [120.0", text), encoding="utf-8")
    problems = check_rig(CheckOptions(str(found.folder)), tmp_path, lambda _text, _share: None).problems
    assert len(problems) == 1
    assert f"`exograv rig motion {found.folder} --write`" in problems[0]


def test_a_floating_base_and_a_torso_stand_still(tmp_path: Path):
    floating = '<joint name="float" type="floating"><parent link="world"/><child link="pelvis"/></joint>'
    text = WHOLE_BODY.replace("</robot>", link("world") + floating + "</robot>")
    found = new(tmp_path, text, side="right")
    assert found.joints == NAMES
    assert any("floating base" in note for note in found.notes)


def test_all_faults_of_a_file_are_said_at_once(tmp_path: Path):
    text = ONE_ARM.replace('value="2.0"', 'value="-2"').replace('effort="30"', 'effort="x"')
    text = text.replace('xyz="0 0 -0.29"', 'xyz="0 0 nan"').replace('type="revolute"', 'type="screw"', 1)
    with pytest.raises(ModelError) as caught:
        new(tmp_path, text)
    for part in ("weighs -2.0 kg", "effort is 'x'", "xyz is '0 0 nan'", "type 'screw'"):
        assert part in str(caught.value)


def test_a_ring_of_links_is_said_with_all_other_faults_and_the_search_ends(tmp_path: Path):
    back = joint("back", ("d_right_elbow", "a_right_elbow"), "0 0 0", "0 0 1", kind="fixed")
    text = ONE_ARM.replace("</robot>", back + link("loose", 1.0) + "</robot>").replace('value="2.0"', 'value="-2"')
    with pytest.raises(ModelError) as caught:
        new(tmp_path, text)
    for part in ("weighs -2.0 kg", "joint 'back' leads back to 'a_right_elbow'", "found base, loose"):
        assert part in str(caught.value)


def test_a_xacro_file_is_told_to_be_expanded(tmp_path: Path):
    text = ONE_ARM.replace('"0 0 -0.29"', '"0 0 ${-length}"')
    with pytest.raises(ModelError, match=r"Expand it first: xacro arm\.urdf\.xacro > arm\.urdf$"):
        new(tmp_path, text, "arm.urdf.xacro")


def test_the_joints_that_are_named_are_the_machines_joints(tmp_path: Path):
    assert new(tmp_path, ONE_ARM, joints=NAMES[2:]).joints == NAMES[2:]
    with pytest.raises(ConfigError, match="--joints names nothing"):
        new_rig(NewRigOptions(tmp_path / "machine.urdf", tmp_path / "other", joints=("nothing",)))


def test_a_file_without_a_joint_of_an_arm_says_which_joints_it_has(tmp_path: Path):
    text = robot("exo", link("pelvis"), legs("right", -0.1))
    with pytest.raises(ConfigError, match=r"right_knee: a joint of the legs.*--joints"):
        new(tmp_path, text)


def test_cuffs_and_shoulder_are_added_where_the_arm_is(tmp_path: Path):
    found = new(tmp_path, ONE_ARM)
    answered(found.folder, FOUR)
    tree = tree_of(found.folder)
    assert tree.frames["exograv_shoulder_centre"].p_body_frame == pytest.approx([0.0, -0.2, 0.5])
    cuff = tree.frames["exograv_forearm_cuff"]
    assert cuff.body == 3
    assert cuff.R_body_frame[:, 2] == pytest.approx([0.0, 0.0, 1.0])
    assert data_of(found)["donning"]["posture_deg"] == pytest.approx([0.0, 0.0, 0.0, 90.0], abs=0.2)


def test_drive_data_of_the_table_hold_for_every_joint_that_does_not_override_them(tmp_path: Path):
    found = new(tmp_path, ONE_ARM)
    answered(found.folder, FOUR)
    path = found.folder / "rig.toml"
    text = path.read_text(encoding="utf-8")
    own = 'joint = "right_elbow"\nplace = "elbow"'
    assert own in text
    path.write_text(text.replace(own, f"gear_ratio = 50.0\n{own}"), encoding="utf-8")
    drives = load_rig(str(found.folder)).settings.actuators
    assert [one.gear_ratio for one in drives] == [100.0, 100.0, 100.0, 50.0]


def test_a_key_in_the_table_of_drives_that_belongs_to_one_joint_is_refused(tmp_path: Path):
    found = new(tmp_path, ONE_ARM)
    answered(found.folder, FOUR)
    path = found.folder / "rig.toml"
    path.write_text(path.read_text("utf-8").replace("[drives]\n", '[drives]\nplace = "elbow"\n'), encoding="utf-8")
    with pytest.raises(ConfigError, match=r"drives has the keys place; allowed: drive"):
        load_rig(str(found.folder))


@pytest.mark.parametrize(("arm_deg", "is_wrong"), [("[0.0, 5.0, 0.0, 90.0]", True), ("[5.0, 0.0, 0.0, 90.0]", False)])
@pytest.mark.usefixtures("without_picture")
def test_flexion_and_abduction_that_are_swapped_by_five_degrees_are_a_problem(
    arm_deg: str, is_wrong: bool, tmp_path: Path
):
    found = new(tmp_path, ONE_ARM)
    answered(found.folder, FOUR)
    path = found.folder / "rig.toml"
    lines = path.read_text(encoding="utf-8").splitlines()
    at = lines.index("[donning]")
    lines[at + 1 : at + 3] = ["posture_deg = [5.0, 0.0, 0.0, 90.0]", f"arm_posture_deg = {arm_deg}"]
    path.write_text("\n".join(lines), encoding="utf-8")
    problems = check_rig(CheckOptions(str(found.folder)), tmp_path, lambda _text, _share: None).problems
    assert ["swapped it points there" in problem for problem in problems] == [True] * is_wrong


@pytest.mark.usefixtures("without_picture")
def test_a_motion_that_is_only_proposed_is_said_until_a_designed_one_is_written(tmp_path: Path):
    found = new(tmp_path, ONE_ARM)
    answered(found.folder, FOUR)
    rig = str(found.folder)
    assert "--write" in str(motion_note(rig))
    notes = check_rig(CheckOptions(rig), tmp_path, lambda _text, _share: None).notes
    assert any("not designed for this machine" in note for note in notes)
    before = (found.folder / "rig.toml").read_text(encoding="utf-8")
    block = load_rig(rig).excitation.model_copy(update={"source": "designed", "period_s": 30.0})
    write_excitation(found.folder / "rig.toml", block)
    after = (found.folder / "rig.toml").read_text(encoding="utf-8")
    assert motion_note(rig) is None
    assert load_rig(rig).excitation == block
    assert after.startswith(before[: before.index("[excitation]")])


IMPOSSIBLE = 'ixx="2.4e-06" ixy="1e-06" ixz="1e-06" iyy="2.4e-06" iyz="1e-06" izz="7.5e-07"'


def impossible(name: str, mass: float) -> str:
    """Return a link whose inertia no body has."""
    return f'<link name="{name}"><inertial><mass value="{mass}"/><inertia {IMPOSSIBLE}/></inertial></link>'


def test_a_finger_with_an_impossible_inertia_is_taken_as_a_ball_of_its_mass(tmp_path: Path):
    finger = [impossible("finger", 0.036), joint("f", ("d_right_elbow", "finger"), "0 0 -0.3", "0 1 0", "0 0.04 9 1")]
    found = new(tmp_path, robot("exo", link("base"), arm("base", NAMES), *finger), joints=NAMES)
    assert any("balls of steel" in note and "finger 0.036 kg" in note for note in found.notes)
    answered(found.folder, FOUR)
    assert tree_of(found.folder).phi[3, 0] == pytest.approx(0.7 + 0.036)


def test_a_moving_link_with_an_impossible_inertia_is_refused_beside_all_other_faults(tmp_path: Path):
    wrong, count = re.subn('<link name="d_right_elbow">.*</link>', impossible("d_right_elbow", 0.7), ONE_ARM)
    assert count == 1
    with pytest.raises(ModelError, match="no body has the inertia of link 'd_right_elbow'"):
        new(tmp_path, wrong)
    with pytest.raises(ModelError) as caught:
        new(tmp_path, wrong.replace('effort="30"', 'effort="x"'))
    for part in ("no body has the inertia", "effort is 'x'"):
        assert part in str(caught.value)


@pytest.mark.parametrize(("offset", "asked"), [("0 0.0315 -0.15", 0), ("0.02 0.02 -0.05", 4)], ids=["arm", "short"])
def test_numbered_joints_get_their_places_if_the_fourth_axis_is_as_far_as_an_elbow(
    offset: str, asked: int, tmp_path: Path
):
    text = robot("exo", link("base"), arm("base", NUMBERS))
    elbow = f'<child link="d_{NUMBERS[3]}"/><origin xyz="0 0 -0.29"/>'
    assert elbow in text
    found = new(tmp_path, text.replace(elbow, elbow.replace("0 0 -0.29", offset)), side="right")
    assert [question.key for question in found.questions].count("actuators.place") == asked
