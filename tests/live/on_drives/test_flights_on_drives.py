"""Commands over simulated drives in another process, in real time: an arm is kept and checked again, a session is run.

The commands hold no twin: only the process of the drives has one.
"""

import json
import shutil
import subprocess
import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest
from tests.console.of_process import short_training

from exograv.rig.drives.simulated.address import free_port
from exograv.safety.stops import StopReason

pytestmark = pytest.mark.slow

SEED, LEVEL, PERIOD_MS = 1022, 1, 4
"""The longest period leaves a busy computer the most time: these tests are about steps and files, not about timing."""

ATTEMPTS = 3
OF_COMPUTER = (
    StopReason.MACHINE_SILENT, StopReason.CONTROL_SILENT, StopReason.DRIVE_FAULT, StopReason.TORQUE_WRONG,
)  # fmt: skip
"""Causes of a stop when the simulated drives or control get no processor in time."""

EXAMPLE = Path(__file__).parents[3] / "examples" / "drives" / "udp.toml"


@dataclass(frozen=True)
class Machine:
    """Calibrated and tested machine on simulated drives, with its files in a folder."""

    folder: Path

    def exograv(self, *words: str) -> "subprocess.CompletedProcess[str]":
        machine = ["--simulate", "--drives", "udp.toml", "--level", str(LEVEL), "--seed", str(SEED)]
        command = [sys.executable, "-m", "exograv.cli", *words, *machine, "--json", "figures.json"]
        return subprocess.run(
            command, cwd=self.folder, capture_output=True, text=True, check=False, stdin=subprocess.DEVNULL
        )

    def flown(self, *words: str, begins: Callable[[], object] = lambda: None) -> dict[str, Any]:
        """Run a command with a fresh pass of the self-test, again if the computer was too slow; return its figures."""
        said = ""
        for _ in range(ATTEMPTS):
            begins()
            shutil.copy(self.folder / "pass.toml", self.folder / "out" / "self_test.toml")
            process = self.exograv(*words)
            said = process.stdout + process.stderr
            if process.returncode == 0:
                return json.loads((self.folder / "figures.json").read_text(encoding="utf-8"))
            assert any(cause.value in said for cause in OF_COMPUTER), said
        pytest.skip(f"The computer was too slow for {ATTEMPTS} flights: {said[-500:]}")


@pytest.fixture(scope="module")
def machine(tmp_path_factory: pytest.TempPathFactory) -> Machine:
    folder = tmp_path_factory.mktemp("machine")
    text = EXAMPLE.read_text(encoding="utf-8")
    for before, after in (
        ("period_ms = 1", f"period_ms = {PERIOD_MS}"),
        ("watchdog_ms = 20.0", "watchdog_ms = 30.0"),
        ("port = 47100", f"port = {free_port()}"),
    ):
        assert before in text
        text = text.replace(before, after, 1)
    (folder / "udp.toml").write_text(text, encoding="utf-8")
    made = Machine(folder)
    for command in (("rig", "calibrate"), ("rig", "self-test")):
        process = made.exograv(*command)
        assert process.returncode == 0, process.stdout + process.stderr
    shutil.copy(folder / "out" / "self_test.toml", folder / "pass.toml")
    return made


def test_an_arm_is_kept_and_only_checked_the_next_time(machine: Machine):
    first = machine.flown("arm", "identify", "--seconds", "25", "--keep", "arm.toml", "--code", "P-08")
    assert (first["from_file"], first["person"]["code"], first["person"]["donnings"]) == (False, "P-08", 1)
    assert first["live"]["identified"]["arm_check"].startswith("The arm may be that of a person of")
    again = machine.flown("arm", "identify", "--participant", "arm.toml", "--keep", "again.toml")
    assert (again["from_file"], again["person"]["code"], again["person"]["donnings"]) == (True, "P-08", 2)
    assert again["live"]["identified"]["motion_s"] < first["live"]["identified"]["motion_s"]


def test_a_session_runs_from_the_motors_that_switch_on_to_the_arm_that_is_given_back(machine: Machine):
    protocol = short_training(machine.folder)
    session = ("--participant", "P-07", "--protocol", protocol.name)

    def forget() -> None:
        for path in (machine.folder / "out").glob("*.run.json"):
            path.unlink()

    found = machine.flown("run", "train", *session, "--port", "0", begins=forget)
    assert found["is_complete"]
    assert found["windows"] == 2
    assert not found["preparation"]["from_file"]
    process = machine.exograv("next", *session)
    assert "session 2 of 'short.toml' has not begun." in " ".join(process.stdout.split())
    assert (machine.folder / "out" / "participants" / "P-07.toml").is_file()
