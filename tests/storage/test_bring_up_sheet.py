"""The sheet of a bring-up records all steps, and a later change is found."""

from datetime import UTC, datetime
from pathlib import Path

import numpy as np
import pytest

from exograv.errors import ConfigError
from exograv.live.options import RigTestOptions
from exograv.model.description import load_rig
from exograv.procedures.bring_up.simulated_drives_file import drives_of, written
from exograv.procedures.bring_up.unpowered_steps import wiring
from exograv.rig.drives.settings import Drives, load_drives
from exograv.storage.bring_up_sheet import BringUpSheet, passed_sheet, write_sheet
from exograv.storage.sealed_file import read_sealed
from exograv.storage.self_test_step import Step

RIG = load_rig("recupera_like")
OLD_SHEET = Path(__file__).parent / "data" / "rig_test_version_1.toml"
NOW = datetime(2026, 11, 22, 12, 0, tzinfo=UTC)


@pytest.fixture
def drives(tmp_path: Path) -> Drives:
    return load_drives(written(tmp_path, RIG), RIG)


def sheet_of(tmp_path: Path, drives: Drives, *steps: Step) -> BringUpSheet:
    return write_sheet(tmp_path / "sheet.toml", RIG, drives, list(steps), "ab", NOW, simulated=True)


def test_a_sheet_passes_only_where_every_step_was_tried_and_passed(tmp_path: Path, drives: Drives):
    good, bad, untried = Step("a", True, 1.0, 2.0), Step("b", False, 3.0, 2.0), Step("c", None)
    assert sheet_of(tmp_path, drives, good).done.passed
    assert not sheet_of(tmp_path, drives, good, bad).done.passed
    assert not sheet_of(tmp_path, drives, good, untried).done.passed


def test_a_changed_sheet_is_refused(tmp_path: Path, drives: Drives):
    sheet_of(tmp_path, drives, Step("nudge", False, 31.0, 30.0, "N·m"))
    path = tmp_path / "sheet.toml"
    assert read_sealed(path, BringUpSheet, "", "").steps[0].value == "31"
    path.write_text(path.read_text(encoding="utf-8").replace("31", "29"), encoding="utf-8")
    with pytest.raises(ConfigError, match="sheet"):
        read_sealed(path, BringUpSheet, "Repeat it.", "Repeat it.")


def test_an_interrupted_bring_up_has_not_passed_and_names_its_step(tmp_path: Path, drives: Drives):
    path = tmp_path / "sheet.toml"
    write_sheet(path, RIG, drives, [Step("a", True, 1.0, 2.0)], "ab", NOW, simulated=False, interrupted_at="nudges")
    read = read_sealed(path, BringUpSheet, "", "").done
    assert read.interrupted_at == "nudges"
    assert not read.passed
    with pytest.raises(ConfigError, match="interrupted at the step “nudges”"):
        passed_sheet(path, RIG, drives, "exograv rig test")


def test_a_sheet_of_version_1_is_still_read_and_its_seal_holds():
    read = read_sealed(OLD_SHEET, BringUpSheet, "", "")
    assert read.schema_version == 1
    assert read.done.interrupted_at == ""


def test_an_edited_sheet_of_version_1_is_refused(tmp_path: Path):
    path = tmp_path / "sheet.toml"
    path.write_text(OLD_SHEET.read_text(encoding="utf-8").replace('by = "ab"', 'by = "cd"'), encoding="utf-8")
    with pytest.raises(ConfigError, match="damaged or edited"):
        read_sealed(path, BringUpSheet, "", "")


def test_every_machine_with_motors_gets_simulated_drives_that_fit_it(tmp_path: Path):
    for name in ("recupera_like", "recupera_like_qdd", "recupera_like_7", "agree_like", "nesm_like"):
        rig = load_rig(name)
        drives = load_drives(written(tmp_path / name, rig), rig)
        steps = wiring(drives, rig.per_actuator("torque_max_Nm"), rig.nominal_gain)
        assert all(step.passed for step in steps)


def test_a_drive_that_may_give_ten_times_the_torque_of_its_motor_is_named(tmp_path: Path):
    path = tmp_path / "drives.toml"
    most = RIG.per_actuator("torque_max_Nm")[3] / RIG.nominal_gain[3]
    text = drives_of(RIG, 47100)
    last = text.rindex(f"current_max_A = {most:.4g}")
    path.write_text(text[:last] + text[last:].replace(f"{most:.4g}", f"{10 * most:.4g}"), encoding="utf-8")
    step = wiring(load_drives(path, RIG), RIG.per_actuator("torque_max_Nm"), RIG.nominal_gain)[0]
    assert not step.passed
    assert "elbow_flexion" in step.what_to_do


def test_drives_that_do_not_brake_lock_the_machine_for_people_and_do_not_end_a_bring_up(tmp_path: Path):
    path = tmp_path / "drives.toml"
    text = drives_of(RIG, 47100).replace("brake_Nms_per_rad = 4", "brake_Nms_per_rad = 0")
    path.write_text(text, encoding="utf-8")
    step = wiring(load_drives(path, RIG), np.ones(4), np.ones(4))[1]
    assert step.passed is False
    assert step.locks_only
    assert "elbow_flexion" in step.what_to_do


def test_a_real_bring_up_asks_for_the_file_of_its_drives_and_for_initials():
    with pytest.raises(ConfigError, match="--drives is missing"):
        RigTestOptions("recupera_like")
    with pytest.raises(ConfigError, match="--by is missing"):
        RigTestOptions("recupera_like", drives=Path("drives.toml"))
