"""A session on a virtual clock runs over drives and participant in another process, and is refused with a reason."""

import json
import os
import signal
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from tests.scenario.test_train import short
from tests.waiting import wait_until

from exograv.errors import ConfigError
from exograv.experiment.train.drives_machine import DrivesMachine
from exograv.experiment.train.options import TrainOptions
from exograv.experiment.train.request import asked_for
from exograv.recording import read_recording
from exograv.storage.session_checkpoint import SESSION_FILE
from exograv.task.state import RunState

SEED, LEVEL = 1023, 1
OPTIONS = TrainOptions(simulate=True, virtual_clock=True, participant="P-07")


def machine(options: TrainOptions, folder: Path) -> DrivesMachine:
    return DrivesMachine(options, asked_for(options), None, folder, lambda *_: None, lambda _line: None)


def test_a_machine_that_is_not_calibrated_is_refused_before_a_process_starts(tmp_path: Path):
    with pytest.raises(ConfigError, match="exograv rig calibrate recupera_like --simulate"):
        machine(OPTIONS, tmp_path)
    assert not list(tmp_path.iterdir())


def test_a_flight_is_refused_because_there_is_no_aircraft(tmp_path: Path):
    options = TrainOptions(
        simulate=True, virtual_clock=True, participant="P-07", protocol="flight", rig="recupera_like"
    )
    with pytest.raises(ConfigError, match="has no aircraft"):
        machine(options, tmp_path)


def exograv(folder: Path, *words: str) -> "subprocess.Popen[str]":
    command = [sys.executable, "-m", "exograv", *words, "--simulate", "--level", str(LEVEL), "--seed", str(SEED)]
    return subprocess.Popen(
        command, cwd=folder, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, start_new_session=True
    )


def done(process: "subprocess.Popen[str]") -> str:
    said, _ = process.communicate(timeout=900.0)
    assert process.returncode == 0, said
    return said


@pytest.fixture(scope="module")
def tested(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("machine")
    for command in ("calibrate", "self-test"):
        done(exograv(folder, "rig", command))
    return folder


def drive_processes() -> list[int]:
    """Processes of simulated drives of this seed."""
    found = []
    for entry in Path("/proc").iterdir():
        if entry.name.isdigit():
            words = (entry / "cmdline").read_bytes().split(b"\0") if (entry / "cmdline").exists() else []
            if b"drive-sim" in words and str(SEED).encode() in words:
                found.append(int(entry.name))
    return found


@pytest.mark.slow
def test_a_killed_session_over_drives_is_resumed_and_every_touch_is_recorded_once(tested: Path):
    protocol = short(tested, base="training", rest_s=14.0)
    words = (
        "run",
        "train",
        "--virtual-clock",
        "--participant",
        "P-07",
        "--protocol",
        protocol.name,
        "--json",
        "r.json",
    )
    checkpoint = tested / "out" / "P-07_short_01.simulated.run.json"

    def has_touched() -> bool:
        return checkpoint.exists() and bool(RunState.model_validate_json(SESSION_FILE.read(checkpoint).run).seen)

    process = exograv(tested, *words)
    wait_until(has_touched, "the first touch", 600.0)
    os.killpg(process.pid, signal.SIGKILL)
    process.wait()
    wait_until(lambda: not drive_processes(), "the end of the drives of a killed session", 20.0)
    done(exograv(tested, *words, "--resume"))

    result: dict[str, Any] = json.loads((tested / "r.json").read_text(encoding="utf-8"))
    assert result["is_complete"]
    recording = read_recording(Path(tested / result["recording"]))
    touches = [message["record"] for message in recording.messages("/task") if message["kind"] == "touch"]
    pages: dict[str, list[int]] = {}
    for touch in touches:
        pages.setdefault(touch["page"], []).append(touch["sequence"])
    assert len(pages) == 2
    assert all(numbers == list(range(len(numbers))) for numbers in pages.values())
    ticks = recording.ticks
    assert np.abs(ticks["tau_commanded"]).max() > 1.0
    assert recording.settings["seed"] == SEED
    assert recording.settings["settings"]["participant_model"]
