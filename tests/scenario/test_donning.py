"""A returning person is identified sooner, and the file contains no value that only the examiner knows."""

import json
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from exograv.storage.participant_file import read_participant

SEED = 1012
"""Figures are reported on other seeds (docs/explanation/disturbances.md)."""

pytestmark = pytest.mark.slow


def run(folder: Path, *words: str) -> dict[str, Any]:
    command = [sys.executable, "-m", "exograv.cli", *words, "--seed", str(SEED), "--out", str(folder)]
    subprocess.run([*command, "--json", str(folder / "result.json")], check=True, capture_output=True)
    return json.loads((folder / "result.json").read_text(encoding="utf-8"))


@pytest.fixture(scope="module")
def days(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, dict[str, Any], dict[str, Any]]:
    """File after the first day, and the results of both days."""
    folder = tmp_path_factory.mktemp("days")
    file, calibration = folder / "P-12.toml", folder / "calibration.toml"
    run(folder, "calibrate", "--calibration", str(calibration))
    common = ("identify", "--calibration", str(calibration), "--seconds", "40")
    first = run(folder, *common, "--keep", str(file), "--code", "P-12")
    second = run(folder, *common, "--participant", str(file), "--donning", "1")
    return file, first, second


def test_the_second_donning_reaches_the_target_sooner_than_from_cold(days):
    _, _, second = days
    examiner = second["participant"]["examiner"]
    assert examiner["from_file_s"] is not None
    assert examiner["cold_s"] is None or examiner["from_file_s"] < examiner["cold_s"]


def test_the_right_persons_file_is_not_contradicted(days):
    _, _, second = days
    assert min(second["participant"]["log_evidence_over_table"].values()) > -5.0


def test_the_file_holds_no_truth(days):
    file, first, _ = days
    identified = read_participant(file).identified
    told = {*identified.predicted_left_over_Nm, *identified.held_out_error_Nm, identified.motion_s}
    true = [value for part in ("total", "arm") for value in first["left_over_rms_Nm"][part]["identified"]]
    assert told.isdisjoint(true)
    assert "truth" not in file.read_text(encoding="utf-8")
