"""`exograv rig calibrate` keeps its contract, finds the hidden machine, and its file is used and named."""

import json
import subprocess
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from tests import preloaded

from exograv.recording import read_recording

SEED = 1012
GAIN = 0.01  # Relative error.
FRICTION = {"coulomb_Nm": 0.04, "viscous": 0.08, "breakaway": 0.10}
"""Largest relative errors. Some are those of a bad joint (docs/howto/calibration.md)."""
INSIDE = 0.8
"""Smallest share of intervals that contain the truth. Coverage needs many machines and is measured elsewhere."""
pytestmark = pytest.mark.slow


def exograv(folder: Path, *words: str) -> subprocess.CompletedProcess[str]:
    return preloaded.exograv(*words, "--seed", str(SEED), "--json", "figures.json", folder=folder)


def figures(folder: Path) -> dict[str, Any]:
    return json.loads((folder / "figures.json").read_text(encoding="utf-8"))


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("calibrate")


@pytest.fixture(scope="module")
def found(folder: Path) -> dict[str, Any]:
    result = exograv(folder, "calibrate")
    assert result.returncode == 0, result.stderr
    return figures(folder)


def test_the_promised_keys_are_there(found: dict[str, Any]):
    assert {"rig", "joints", "gain", "friction", "hash", "file", "tilt_deg", "encoder_offset_deg"} <= set(found)
    assert found["rig"] == "recupera_like"
    assert [set(row) for row in found["gain"]] == [{"joint", "true", "estimate", "ci95"}] * 4
    for row in found["friction"]:
        assert {"joint", "coulomb_Nm", "viscous", "breakaway", "load_share"} <= set(row)
        assert {"coulomb_Nm_ci95", "coulomb_Nm_true", "load_share_ci95", "load_share_true"} <= set(row)


def test_the_hidden_gains_and_frictions_are_found(found: dict[str, Any]):
    for row in found["gain"]:
        assert abs(row["estimate"] / row["true"] - 1.0) < GAIN
    for row in found["friction"]:
        for name, share in FRICTION.items():
            assert abs(row[name] / row[f"{name}_true"] - 1.0) < share


def test_the_intervals_are_honest(found: dict[str, Any]):
    rows = [(row["true"], row["ci95"]) for row in found["gain"] + found["encoder_offset_deg"]]
    for row in found["friction"]:
        rows += [(row[f"{name}_true"], row[f"{name}_ci95"]) for name in (*FRICTION, "load_share", "asymmetry_Nm")]
    assert np.mean([low <= truth <= high for truth, (low, high) in rows]) > INSIDE


def test_a_stored_calibration_is_used_and_named_everywhere(folder: Path, found: dict[str, Any]):
    result = exograv(folder, "identify", "--seconds", "5", "--calibration", found["file"])
    assert result.returncode == 0, result.stderr
    used = figures(folder)
    assert used["calibration_used"]["hash"] == found["hash"]
    assert used["calibration_used"]["measured_utc"] == found["measured_utc"]
    assert found["hash"][:12] in result.stdout
    recording = read_recording(Path(folder / used["recording"]))
    assert recording.settings["hashes"]["calibration"] == found["hash"]
    assert found["hash"][:12] in (folder / used["report"]).read_text(encoding="utf-8")


def test_another_machines_calibration_is_refused(folder: Path, found: dict[str, Any]):
    result = exograv(folder, "identify", "--side", "left", "--calibration", found["file"])
    assert result.returncode == 1
    assert "its side is 'right', this one's is 'left'" in result.stderr


def test_a_recheck_finds_the_cold_machines_friction_and_keeps_the_gains(folder: Path, found: dict[str, Any]):
    result = exograv(folder, "calibrate", "--recheck")
    assert result.returncode == 0, result.stderr
    again = figures(folder)
    assert [row["estimate"] for row in again["gain"]] == [row["estimate"] for row in found["gain"]]
    assert again["hash"] != found["hash"]
    assert again["measured_utc"] == found["measured_utc"]
    assert again["simulated_s"] < 0.4 * found["simulated_s"]
    for before, now in zip(found["friction"], again["friction"], strict=True):
        assert now["coulomb_Nm_true"] > before["coulomb_Nm_true"]
        assert abs(now["coulomb_Nm"] / now["coulomb_Nm_true"] - 1.0) < FRICTION["coulomb_Nm"]
