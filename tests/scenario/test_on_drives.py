"""A simulated machine on either bus is calibrated and tested over its drivers, as a real one would be."""

import json
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

SEED = 1021
GAIN = 0.01  # share
INSIDE = 0.8
"""Share of intervals that hold the truth: one machine proves no coverage."""
EXAMPLES = Path(__file__).parents[2] / "examples" / "drives"
pytestmark = pytest.mark.slow


def exograv(folder: Path, *words: str) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-m", "exograv.cli", *words, "--seed", str(SEED), "--json", "figures.json"]
    return subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)


def figures(folder: Path) -> dict[str, Any]:
    return json.loads((folder / "figures.json").read_text(encoding="utf-8"))


@pytest.mark.parametrize("bus", ["udp", "canopen"])
def test_a_machine_on_its_bus_is_calibrated_and_passes_its_self_test(bus: str, tmp_path: Path):
    if bus == "canopen":
        pytest.importorskip("can")
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
