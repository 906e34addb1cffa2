"""New rig: a user's URDF becomes a folder with questions, which is a valid machine once they are answered."""

import errno
import re
import tomllib
from pathlib import Path

import pytest
from tests.foreign_machines import DRIVE_ANSWERS, answered

from exograv.errors import ConfigError, ModelError
from exograv.model.description import load_rig, robots_folder
from exograv.options import Side
from exograv.procedures.machine_tools.check_rig import check_rig
from exograv.procedures.machine_tools.new_rig import new_rig
from exograv.procedures.machine_tools.options import CheckOptions, NewRigOptions

ROBOTS = robots_folder()


def silent(_text: str, _share: float) -> None:
    pass


def answers_for(rig: str) -> dict[str, list[str]]:
    """Return the answers of a machine's builder, taken from the machine's own rig file."""
    settings = load_rig(rig).settings
    donning, box, plan = settings.donning, settings.task_workspace, settings.calibration
    assert plan is not None
    assert settings.excitation is not None
    return DRIVE_ANSWERS | {
        "donning.posture_deg": [str(donning.posture_deg)],
        "donning.arm_posture_deg": [str(donning.arm_posture_deg or donning.posture_deg)],
        "actuators.place": [f'"{actuator.place}"' for actuator in settings.actuators],
        "task_workspace.lower_deg": [str(box.lower_deg)],
        "task_workspace.upper_deg": [str(box.upper_deg)],
        "calibration.mount": [f'"{plan.mount}"'],
        "calibration.sweeps.mount": [f'"{sweep.mount}"' for sweep in plan.sweeps if sweep.mount],
        "calibration.sweeps.posture_deg": [str(sweep.posture_deg) for sweep in plan.sweeps],
    }


@pytest.mark.parametrize(
    ("rig", "file"),
    [
        ("recupera_like", "right.urdf"),
        ("recupera_like_7", "left.urdf"),
        ("recupera_like_dual", "both.urdf"),
        ("nesm_like", "right.urdf"),
    ],
)
@pytest.mark.usefixtures("without_picture")
def test_a_folder_whose_questions_are_answered_is_a_machine_without_problems(rig: str, file: str, tmp_path: Path):
    folder = tmp_path / "mine"
    new_rig(NewRigOptions(ROBOTS / rig / file, folder))
    with pytest.raises(ConfigError, match="still asks"):
        load_rig(str(folder))
    answered(folder, answers_for(rig))
    assert load_rig(str(folder)).joints == load_rig(rig).joints
    result = check_rig(CheckOptions(str(folder)), tmp_path, silent)
    assert result.problems == []
    assert result.rank == result.human_dof


@pytest.mark.parametrize(("beyond", "kind", "hand"), [(1, "forearm", False), (2, "wrist_flexion", True)])
def test_how_far_down_the_arm_is_moved_is_read_from_the_names_of_the_joints(
    beyond: int, kind: str, hand: bool, tmp_path: Path
):
    text = (ROBOTS / "recupera_like_7" / "right.urdf").read_text(encoding="utf-8")
    for name in ("forearm_roll", "wrist_flexion", "wrist_deviation")[beyond:]:
        text = text.replace(f'<joint name="{name}" type="revolute">', f'<joint name="{name}" type="fixed">')
    (tmp_path / "machine.urdf").write_text(text, encoding="utf-8")
    new_rig(NewRigOptions(tmp_path / "machine.urdf", tmp_path / "mine"))
    written = (tmp_path / "mine" / "rig.toml").read_text(encoding="utf-8")
    assert f'[wearer]\narm = "{kind}"' in written
    assert ('segment = "hand"' in written) == hand


def test_every_question_says_how_to_answer_it(tmp_path: Path):
    found = new_rig(NewRigOptions(ROBOTS / "recupera_like" / "right.urdf", tmp_path / "mine"))
    assert found.questions
    assert all(len(question.comment) > 5 for question in found.questions)


def test_all_questions_are_problems_of_the_check_at_once(tmp_path: Path):
    found = new_rig(NewRigOptions(ROBOTS / "recupera_like" / "right.urdf", tmp_path / "mine"))
    result = check_rig(CheckOptions(str(tmp_path / "mine")), tmp_path, silent)
    assert len(result.problems) == len(found.questions)
    assert all("still asks" in problem for problem in result.problems)


def numbered(folder: Path, rig: str, *pairs: tuple[str, str]) -> Path:
    """Return the URDF of a machine without names that tell anything, after each old text was replaced by the new."""
    text = (ROBOTS / rig / "right.urdf").read_text(encoding="utf-8")
    for old, new in pairs:
        assert old in text
        text = text.replace(old, new)
    for i, name in enumerate(load_rig(rig).joints):
        text = text.replace(f'"{name}"', f'"J{i + 1}"')
    path = folder / "machine.urdf"
    path.write_text(re.sub(r'robot name="\w+"', 'robot name="My machine"', text), encoding="utf-8")
    return path


def test_the_side_is_asked_for_if_no_name_tells_it(tmp_path: Path):
    found = new_rig(NewRigOptions(numbered(tmp_path, "agree_like"), tmp_path / "mine"))
    assert "urdf.side" in [question.key for question in found.questions]


@pytest.mark.parametrize(("rig", "kind"), [("recupera_like_7", "whole"), ("recupera_like", "shoulder_elbow")])
def test_numbered_joints_get_their_places_and_cuffs_from_their_positions(rig: str, kind: str, tmp_path: Path):
    found = new_rig(NewRigOptions(numbered(tmp_path, rig), tmp_path / "mine"))
    assert "actuators.place" not in [question.key for question in found.questions]
    data = tomllib.loads((tmp_path / "mine" / "rig.toml").read_text(encoding="utf-8"))
    assert data["wearer"]["arm"] == kind
    assert tuple(one["place"] for one in data["actuators"]) == load_rig(rig).places
    assert [cuff["exo_frame"] for cuff in data["cuffs"]] == [cuff.exo_frame for cuff in load_rig(rig).settings.cuffs]


def test_the_places_of_numbered_joints_are_asked_for_if_the_shoulder_axes_do_not_meet(tmp_path: Path):
    apart = '<child link="upper_arm_exo"/>\n    <origin xyz="{} 0 0"'
    path = numbered(tmp_path, "recupera_like_7", (apart.format("0"), apart.format("0.05")))
    keys = [question.key for question in new_rig(NewRigOptions(path, tmp_path / "mine")).questions]
    assert keys.count("actuators.place") == 7
    assert "wearer.arm" in keys


def test_joints_of_the_wrist_get_a_place_of_the_weights_beside_the_forearm(tmp_path: Path):
    new_rig(NewRigOptions(ROBOTS / "recupera_like_7" / "right.urdf", tmp_path / "mine"))
    data = tomllib.loads((tmp_path / "mine" / "rig.toml").read_text(encoding="utf-8"))
    mounts = [sweep.get("mount") for sweep in data["calibration"]["sweeps"]]
    assert mounts == [None] * 4 + ["exograv_wrist_mount"] * 3


@pytest.mark.parametrize("side", ["right", "left", "both"])
def test_the_side_that_is_given_is_not_asked_for(side: Side, tmp_path: Path):
    new_rig(NewRigOptions(ROBOTS / "recupera_like" / "right.urdf", tmp_path / "mine", side))
    assert f'[urdf]\n{side} = "right.urdf"' in (tmp_path / "mine" / "rig.toml").read_text(encoding="utf-8")


def test_pictures_and_their_meshes_stay_behind(tmp_path: Path):
    text = (ROBOTS / "recupera_like" / "right.urdf").read_text(encoding="utf-8")
    mesh = '<visual>\n  <geometry><mesh filename="a.stl"/></geometry>\n</visual>\n<collision name="c"/>\n'
    (tmp_path / "machine.urdf").write_text(text.replace("</inertial>", f"</inertial>{mesh}", 1), encoding="utf-8")
    new_rig(NewRigOptions(tmp_path / "machine.urdf", tmp_path / "mine"))
    copied = (tmp_path / "mine" / "machine.urdf").read_text(encoding="utf-8")
    assert "stl" not in copied
    assert "collision" not in copied
    assert copied.count("<inertial>") == text.count("<inertial>")


def test_a_folder_that_exists_is_never_touched(tmp_path: Path):
    (tmp_path / "mine").mkdir()
    with pytest.raises(ConfigError, match="exists already; nothing is overwritten"):
        new_rig(NewRigOptions(ROBOTS / "recupera_like" / "right.urdf", tmp_path / "mine"))
    assert not list((tmp_path / "mine").iterdir())


def test_a_urdf_that_cannot_be_read_leaves_no_folder(tmp_path: Path):
    (tmp_path / "broken.urdf").write_text("<robot", encoding="utf-8")
    with pytest.raises(ModelError, match="not valid XML"):
        new_rig(NewRigOptions(tmp_path / "broken.urdf", tmp_path / "mine"))
    assert not (tmp_path / "mine").exists()


def test_a_full_disk_leaves_no_half_folder_so_that_the_command_can_be_repeated(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    options = NewRigOptions(urdf=load_rig("recupera_like").urdf_path, out=tmp_path / "mine")
    write = Path.write_text

    def full(path: Path, text: str, **how: str) -> int:
        if path.name == "rig.toml":
            raise OSError(errno.ENOSPC, "No space left on device")
        return write(path, text, **how)

    with monkeypatch.context() as patched:
        patched.setattr(Path, "write_text", full)
        with pytest.raises(ConfigError, match="No space left"):
            new_rig(options)
    assert list(tmp_path.iterdir()) == []
    assert new_rig(options).folder == tmp_path / "mine"
