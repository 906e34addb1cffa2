"""The printouts of machine commands are complete on a narrow terminal, and say what to do next."""

import sys
from pathlib import Path

import pytest

from exograv import cli
from exograv.cli.machine.check_rig import _show
from exograv.cli.machine.computer_check import Check, ComputerCheck, _writable
from exograv.cli.machine.doctor import next_steps
from exograv.cli.shell.motion_note import say_twin
from exograv.procedures.machine_tools.check_rig.check_result import CheckResult
from exograv.report.figures.machine_data import TorqueRow

JOINTS = ("shoulder_flexion", "shoulder_abduction", "shoulder_rotation", "elbow_flexion")


def checked(limit: float | None, problems: list[str]) -> CheckResult:
    """Return the figures of a checked machine."""
    rows = [TorqueRow(joint, limit, 6.2, 10.4, 5.7, 3.2) for joint in JOINTS]
    return CheckResult(
        "my_machine",
        side="right",
        rank=4,
        human_dof=4,
        torque_Nm=rows,
        largest_arm_kg=5.0,
        problems=problems,
        ok=not problems,
    )


def test_a_narrow_terminal_shows_every_joint_and_heading_in_full(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
):
    monkeypatch.setenv("COLUMNS", "40")
    _show(checked(60.0, []), "my_machine")
    shown = capsys.readouterr().out
    assert "…" not in shown
    assert all(len(line) <= 40 for line in shown.splitlines())
    words = set(shown.split())
    assert {word for joint in JOINTS for word in joint.split("_")} | {"machine", "hand", "drive"} <= words


@pytest.mark.parametrize(
    ("limit", "problems", "next_command", "absent"),
    [
        (60.0, [], "exograv rig test folder/my --simulate", "again"),
        (None, [], "exograv data view folder/my", "rig test"),
        (60.0, ["No cuff."], "exograv rig check folder/my", "rig test"),
    ],
)
def test_a_check_names_the_next_command_for_the_machine_as_it_was_typed(
    limit: float | None,
    problems: list[str],
    next_command: str,
    absent: str,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
):
    monkeypatch.setenv("COLUMNS", "200")
    _show(checked(limit, problems), "folder/my")
    shown = capsys.readouterr().out
    assert next_command in shown
    assert absent not in shown


@pytest.mark.parametrize(
    ("ok", "missing", "line"),
    [
        (True, {"twin": [], "study": []}, "Next: exograv demo"),
        (True, {"twin": ["mujoco"], "study": ["pandas"]}, "`exograv demo` needs exograv[twin,study]."),
        (False, {}, "Correct what is marked NO, then run `exograv doctor` again."),
    ],
)
def test_the_doctor_ends_with_the_next_step(ok: bool, missing: dict[str, list[str]], line: str):
    assert next_steps(ComputerCheck(ok, "Linux", [Check("out", ok, "")], None, missing))[-1] == line


def test_the_doctor_leaves_no_folder_behind(tmp_path: Path):
    assert _writable(tmp_path / "new" / "out").ok
    assert not list(tmp_path.iterdir())


def test_a_form_that_is_refused_ends_with_a_status_for_scripts(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "argv", ["exograv", "arm", "weigh", "--body-mass", "700", "--json", "weigh.json"])
    with pytest.raises(SystemExit) as end:
        cli.main()
    assert end.value.code == 1
    assert capsys.readouterr().out.startswith("REFUSED. ")
    assert '"refused": true' in Path("weigh.json").read_text(encoding="utf-8")


@pytest.mark.parametrize(("twin", "said"), [("fitted", True), ("drawn", False)])
def test_a_draw_from_a_fitted_twin_is_said_to_be_one(twin: str, said: bool, capsys: pytest.CaptureFixture[str]):
    say_twin(twin)
    assert ("draw from the posterior" in capsys.readouterr().out) is said
