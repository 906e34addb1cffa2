"""A simulated machine on any bus is calibrated, tested and worn over its drivers, as a real one would be."""

import json
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

SEED = 1021
GAIN = 0.01  # Relative error.
INSIDE = 0.8
"""Smallest share of intervals that contain the truth. One machine proves no coverage."""
SHOULDER_NM, ELBOW_NM = 0.5, 0.25
"""Coarse target, because twenty seconds are a third of the usual motion."""
PAUSE_MS = 5.0
"""Gap just before a stop that is blamed on the computer and not on a drive: longer than any bridge."""
EXAMPLES = Path(__file__).parents[2] / "examples" / "drives"
pytestmark = pytest.mark.slow


def exograv(folder: Path, *words: str) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-m", "exograv.cli", *words, "--seed", str(SEED), "--json", "figures.json"]
    return subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)


def figures(folder: Path) -> dict[str, Any]:
    return json.loads((folder / "figures.json").read_text(encoding="utf-8"))


@pytest.mark.parametrize("bus", ["udp", "canopen", "moteus"])
def test_a_machine_on_its_bus_is_calibrated_tested_and_lets_the_arm_float(bus: str, tmp_path: Path):
    if bus != "udp":
        pytest.importorskip("can" if bus == "canopen" else bus)
    drives = ["--simulate", "--drives", str(EXAMPLES / f"{bus}.toml")]
    result = exograv(tmp_path, "calibrate", *drives)
    assert result.returncode == 0, result.stderr
    found = figures(tmp_path)
    held = []
    for joint in found["gain"]:
        assert joint["estimate"] == pytest.approx(joint["true"], rel=GAIN), joint["joint"]
        held.append(joint["ci95"][0] <= joint["true"] <= joint["ci95"][1])
    for joint in found["friction"]:
        for key in ("coulomb_Nm", "viscous", "breakaway", "load_share"):
            low, high = joint[f"{key}_ci95"]
            held.append(low <= joint[f"{key}_true"] <= high)
    assert sum(held) >= INSIDE * len(held)
    result = exograv(tmp_path, "self-test", *drives)
    assert result.returncode == 0, result.stdout + result.stderr
    assert figures(tmp_path)["self_test"].startswith("passed")
    if bus == "moteus":
        return  # `live` is not tested on this bus.
    result = exograv(tmp_path, "live", *drives, "--identify", "20", "--seconds", "10")
    assert result.returncode == 0, result.stdout + result.stderr
    found = figures(tmp_path)
    if any(latch["stall_ms"] > PAUSE_MS for latch in found["latches"]):
        pytest.skip(f"The computer paused, and the guard stopped the machine: {found['latches']}")
    assert not found["latches"]
    assert found["modes"][-1]["mode"] == "floating"
    *shoulder, elbow = found["identified"]["left_over_Nm"]
    assert max(shoulder) < SHOULDER_NM
    assert elbow < ELBOW_NM
