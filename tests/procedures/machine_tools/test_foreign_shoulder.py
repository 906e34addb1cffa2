"""Machines with fewer than three shoulder axes, limits of zero and copied inertials become machines with few questions.

The files have the forms of exoskeletons that others have published (docs/results/results.md).
"""

import re
from pathlib import Path

import pytest
from tests.foreign_machines import FOUR, NAMES, ONE_AXIS, answered, arm, joint, link, robot, task, written

from exograv.errors import ConfigError
from exograv.model.assembly import read_exoskeleton
from exograv.model.description import load_rig
from exograv.model.urdf_inference import arms
from exograv.procedures.machine_tools.check_rig import check_rig
from exograv.procedures.machine_tools.check_rig.check_result import CheckResult
from exograv.procedures.machine_tools.new_rig import new_rig
from exograv.procedures.machine_tools.options import CheckOptions, NewRigOptions

COPIED = ' <inertial><origin xyz="0 0 -0.009"/><mass value="2.7"/><inertia ixx="0.02" iyy="0.02" izz="0.01" ixy="0"\
 ixz="0" iyz="0"/></inertial>'
TWO_AXES = robot(
    "frame",
    link("base"),
    f'<link name="pitch">{COPIED}</link><link name="yaw">{COPIED}</link><link name="lower">{COPIED}</link>',
    link("dummy_lower_arm", 1.5),
    joint("shoulder_pitch", ("base", "pitch"), "0 -0.1 0.7", "0 -1 0", "0.0 2.6 40 5"),
    joint("shoulder_yaw", ("pitch", "yaw"), "0 0.08 -0.1", "0 0 1", "-0.7 0.7 40 5"),
    joint("elbow", ("yaw", "lower"), "0 0.05 -0.19", "0 -1 0", "0.0 2.6 40 5"),
    joint("worn", ("lower", "dummy_lower_arm"), "0 -0.05 -0.13", "0 0 1", kind="fixed"),
)
RANGES = {"actuators.range_deg": ["[-120.0, 40.0]", "[0.0, 130.0]"]}


def checked(folder: Path) -> CheckResult:
    return check_rig(CheckOptions(str(folder)), folder.parent, lambda _text, _share: None)


@pytest.mark.usefixtures("without_picture")
def test_a_machine_with_one_shoulder_axis_asks_only_for_its_drives_limits_and_task(tmp_path: Path):
    found = new_rig(NewRigOptions(written(tmp_path, ONE_AXIS), tmp_path / "mine", side="right"))
    keys = {question.key.split(".")[0] for question in found.questions}
    assert keys == {"adjustments", "drives", "actuators", "task_workspace", "calibration"}
    # The range must hold the posture that the file proposes above it.
    assert any("donning.posture_deg is at 90.0" in question.comment for question in found.questions)
    answered(found.folder, task("[-90.0, 25.0]", "[0.0, 110.0]") | RANGES)
    result = checked(found.folder)
    assert result.problems == []
    assert result.rank == result.human_dof == 4
    centre = read_exoskeleton(load_rig(str(found.folder))).frame("exograv_shoulder_centre")
    assert centre.p_body_frame == pytest.approx([0.0, -0.16, 1.05])


@pytest.mark.usefixtures("without_picture")
def test_a_machine_whose_hanging_arm_is_at_its_limits_needs_no_other_posture(tmp_path: Path):
    options = NewRigOptions(written(tmp_path, TWO_AXES), tmp_path / "mine", side="right", wearer_links="leave-out")
    found = new_rig(options)
    answered(found.folder, task("[5.0, -25.0, 25.0]", "[90.0, 25.0, 110.0]"))
    result = checked(found.folder)
    assert result.problems == []
    tree = read_exoskeleton(load_rig(str(found.folder)))
    assert arms(tree)[0].meeting == pytest.approx([0.0, -0.02, 0.7])
    # Every centre of mass lies on its joint's axis; the place of the wearer's forearm shows where the forearm is.
    assert tree.frame("exograv_forearm_cuff").p_body_frame == pytest.approx([0.0, -0.05, -0.17])
    assert tree.phi[:, 0].sum() == pytest.approx(3 * 2.7)


@pytest.mark.usefixtures("without_picture")
def test_inertials_that_no_machine_has_are_noted_and_no_problem(tmp_path: Path):
    text = ONE_AXIS.replace('<mass value="0.9"/>', '<mass value="0.01"/>')
    found = new_rig(NewRigOptions(written(tmp_path, text), tmp_path / "mine", side="right"))
    answered(found.folder, task("[-90.0, 25.0]", "[0.0, 110.0]") | RANGES)
    result = checked(found.folder)
    assert result.problems == []
    assert any("'upperArm' of 0.01 kg" in note and "0.6 m away" in note for note in result.notes)

    options = NewRigOptions(written(tmp_path, TWO_AXES), tmp_path / "two", side="right", wearer_links="leave-out")
    found = new_rig(options)
    answered(found.folder, task("[5.0, -25.0, 25.0]", "[90.0, 25.0, 110.0]"))
    assert any("'pitch', 'yaw', 'lower' have the same mass" in note for note in checked(found.folder).notes)


def test_an_open_question_for_the_side_is_the_only_problem_of_the_file_entry(tmp_path: Path):
    found = new_rig(NewRigOptions(written(tmp_path, ONE_AXIS), tmp_path / "mine"))
    problems = checked(found.folder).problems
    assert len(problems) == len(found.questions)
    path = found.folder / "rig.toml"
    path.write_text(path.read_text(encoding="utf-8").replace('side = "?"', 'side = "Right"'), encoding="utf-8")
    assert any("it must be 'right', 'left' or 'both'" in problem for problem in checked(found.folder).problems)


def test_a_machine_whose_two_shoulder_axes_do_not_meet_is_asked_for_its_shoulder(tmp_path: Path):
    text = TWO_AXES.replace('xyz="0 0.08 -0.1"', 'xyz="0.03 0.08 -0.1"')
    found = new_rig(NewRigOptions(written(tmp_path, text), tmp_path / "mine", side="right", wearer_links="leave-out"))
    (question,) = [one for one in found.questions if one.key == "wearer.shoulder_centre"]
    assert "two shoulder axes do not meet" in question.comment


def apart(offset: str, names: tuple[str, str, str, str] = NAMES) -> str:
    """Return the file of an arm whose third shoulder axis is moved by an offset [m]."""
    text = robot("exo", link("base"), arm("base", names))
    met = f'<child link="c_{names[3]}"/><origin xyz="0 0 0"/>'
    assert met in text
    return text.replace(met, met.replace("0 0 0", offset))


@pytest.mark.usefixtures("without_picture")
def test_shoulder_axes_that_pass_by_each_other_give_a_proposed_shoulder_if_the_elbow_is_named(tmp_path: Path):
    found = new_rig(NewRigOptions(written(tmp_path, apart("0.05 0.02 0")), tmp_path / "mine"))
    assert len(found.questions) <= 10
    assert any("assumed: the first three axes pass it at up to" in note for note in found.notes)
    answered(found.folder, FOUR)
    result = checked(found.folder)
    assert result.problems == []
    assert result.rank == result.human_dof == 4


@pytest.mark.parametrize(
    ("offset", "names"), [("0.2 0 0", NAMES), ("0.05 0 0", ("J1", "J2", "J3", "J4"))], ids=["far apart", "no elbow"]
)
def test_no_shoulder_is_proposed_for_axes_far_apart_or_without_an_elbow(
    offset: str, names: tuple[str, str, str, str], tmp_path: Path
):
    found = new_rig(NewRigOptions(written(tmp_path, apart(offset, names)), tmp_path / "mine", side="right"))
    assert "wearer.shoulder_centre" in [question.key for question in found.questions]


NUMBERED = ("J1", "J2", "J3", "J4")


@pytest.mark.usefixtures("without_picture")
def test_the_elbow_that_is_named_answers_what_numbered_joints_do_not_tell(tmp_path: Path):
    path = written(tmp_path, apart("0.05 0.02 0", NUMBERED))
    asked = new_rig(NewRigOptions(path, tmp_path / "asked"))
    assert len(asked.questions) > 20
    assert any("--elbow JOINT" in note for note in asked.notes)
    found = new_rig(NewRigOptions(path, tmp_path / "mine", elbow=("J4",)))
    assert len(found.questions) <= 10
    assert not any("--elbow" in note for note in found.notes)
    answered(found.folder, FOUR)
    assert checked(found.folder).problems == []


def test_numbered_joints_without_limits_whose_elbow_is_named_ask_at_most_fifteen_questions(tmp_path: Path):
    text = re.sub(r"<limit [^>]*/>", "", apart("0.05 0.02 0", NUMBERED))
    found = new_rig(NewRigOptions(written(tmp_path, text), tmp_path / "mine", elbow=("J4",)))
    assert len(found.questions) <= 15


def test_an_elbow_that_is_no_joint_of_the_arm_is_refused(tmp_path: Path):
    path = written(tmp_path, apart("0.05 0.02 0", NUMBERED))
    with pytest.raises(ConfigError, match="--elbow names J5; joints that move the arm: J1, J2, J3, J4"):
        new_rig(NewRigOptions(path, tmp_path / "mine", elbow=("J5",)))
    assert not (tmp_path / "mine").exists()
