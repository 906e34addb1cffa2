"""A real machine works on a computer without MuJoCo; here drives in another process take the machine's place."""

import json
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from exograv.laboratory.virtual_laboratory import draw_laboratory

NEEDS_THE_TWIN = (
    "exograv.rig.twin", "exograv.laboratory", "exograv.campaigns", "exograv.experiment.train",
    "exograv.experiment.steered.prepared_machine", "exograv.api.twin",
)  # fmt: skip
"""Rooms and modules that run the twin."""

BLOCK = """
import importlib.abc, sys

# The command line reads the options of runs on the twin; modules of options import no engine.
LIGHT = ("laboratory", "assist", "guided", "support_level", "options")

class Blocked(importlib.abc.MetaPathFinder):
    def find_spec(self, name, path, target=None):
        is_laboratory = name.startswith("exograv.laboratory") and name.rsplit(".", 1)[-1] not in LIGHT
        if name.startswith("exograv.rig.twin") or is_laboratory:
            raise ModuleNotFoundError(f"{name} needs MuJoCo, which is blocked", name="mujoco")

# The simulated drives stand for another computer: only their process may load the twin.
if "drive-sim" not in sys.orig_argv:
    sys.modules["mujoco"] = None
    sys.meta_path.insert(0, Blocked())
"""

IMPORT_ALL = f"""
import importlib, pkgutil, sys
import exograv

for module in pkgutil.walk_packages(exograv.__path__, "exograv."):
    if not module.name.startswith({NEEDS_THE_TWIN}) and not module.name.endswith("__main__"):
        importlib.import_module(module.name)
        print(module.name)
assert not [name for name in sys.modules if name.startswith(("mujoco.", "exograv.rig.twin"))]
"""

REHEARSE = """
from exograv.experiment.steered.rehearsal import RehearsedFlight
from exograv.experiment.steered.session_controller import SessionController

desk = SessionController(RehearsedFlight(side="right"))
try:
    assert desk.shown().rig == "rehearsal"
finally:
    desk.close()
"""

SEED, LEVEL = 3, 0


@pytest.fixture(scope="module")
def environment(tmp_path_factory: pytest.TempPathFactory) -> dict[str, str]:
    """Environment in which no new Python process can import MuJoCo, except that of simulated drives."""
    folder = tmp_path_factory.mktemp("blocked")
    (folder / "sitecustomize.py").write_text(BLOCK)
    paths = [str(folder), str(Path(__file__).parents[1] / "src"), os.environ.get("PYTHONPATH", "")]
    return os.environ | {"PYTHONPATH": os.pathsep.join(filter(None, paths))}


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("machine")


def exograv(
    environment: dict[str, str], folder: Path, command: str, *options: str, passes: bool = True
) -> dict[str, Any]:
    """Run a command on simulated drives; return its figures."""
    out = folder / f"{command}.json"
    words = [
        command,
        "--simulate",
        "--seed",
        str(SEED),
        "--level",
        str(LEVEL),
        "--out",
        str(folder),
        "--json",
        str(out),
    ]
    process = run(environment, "-m", "exograv.cli", *words, *options)
    assert process.returncode == (0 if passes else 1), process.stdout + process.stderr
    return json.loads(out.read_text())


def run(environment: dict[str, str], *words: str) -> "subprocess.CompletedProcess[str]":
    return subprocess.run([sys.executable, *words], capture_output=True, text=True, env=environment, check=False)


def test_every_room_but_those_that_fly_the_twin_imports(environment: dict[str, str]):
    process = run(environment, "-c", IMPORT_ALL)
    assert process.returncode == 0, process.stderr
    assert "exograv.console.server" in process.stdout
    assert "exograv.api.rig_factory" in process.stdout


def test_a_command_on_the_twin_says_what_is_missing(environment: dict[str, str]):
    process = run(environment, "-m", "exograv.cli", "demo", "--seconds", "5")
    assert process.returncode == 1
    assert "needs exograv[twin]. Install it with: pip install 'exograv[twin]'" in process.stderr


@pytest.mark.long
def test_a_bring_up_of_drives_in_another_process_finds_a_wrong_encoder(environment: dict[str, str], tmp_path: Path):
    wrong = ["--by", "test", "--wrong-encoder", "shoulder_flexion"]
    found = exograv(environment, tmp_path, "rig-test", *wrong, passes=False)
    failed = next(step for step in found["steps"] if step["passed"] is False)
    assert failed["name"] == "shoulder_flexion: encoder, turned by hand"


def test_a_rehearsal_of_the_console_needs_no_twin(environment: dict[str, str]):
    process = run(environment, "-c", REHEARSE)
    assert process.returncode == 0, process.stderr


@pytest.mark.slow
def test_simulated_drives_pass_their_self_test_and_carry_an_arm(environment: dict[str, str], folder: Path):
    calibrated = exograv(environment, folder, "calibrate")
    assert "true" not in calibrated["gain"][0]
    tested = exograv(environment, folder, "self-test")
    assert tested["ok"]
    assert tested["self_test"].startswith("passed")
    laboratory = draw_laboratory("recupera_like", None, LEVEL, SEED)
    form, adjusted = laboratory.form, {one.segment for one in laboratory.description.settings.adjustments}
    person = ["--body-height", str(form.body.height_m), "--body-mass", str(form.body.mass_kg), "--sex", form.body.sex]
    lengths = [
        word for name, value in form.lengths.items() if name in adjusted for word in ("--length", f"{name}={value}")
    ]
    flown = exograv(environment, folder, "live", "--identify", "10", "--seconds", "1", *person, *lengths)
    assert flown["identified"] is not None
    assert flown["identified"]["left_over_Nm"] is None
    assert flown["samples_recorded"] > 0


@pytest.mark.slow
def test_simulated_drives_are_brought_up(environment: dict[str, str], folder: Path):
    assert exograv(environment, folder, "rig-test", "--by", "test")["passed"]
