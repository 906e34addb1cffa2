"""A procedure over drives that is ended in its middle lets the arm down, and says what happened.

The drives wait for the computer.
"""

import os
import subprocess
import sys
from datetime import UTC, datetime
from pathlib import Path

import casadi as ca
import numpy as np
import pytest
from tests.live.on_drives.ended_flight import LEFT
from tests.live.on_drives.ready_machine import PERIOD_MS, ReadyMachine

from exograv.live.guard_job import TIME_IS_OVER
from exograv.model.assembly import read_exoskeleton
from exograv.model.description import RigDescription, load_rig
from exograv.model.kinematics import body_poses, frame_pose
from exograv.motion import Passage
from exograv.procedures.rehabilitation.guided.path_shaping import PERIOD_S, ShapedPath
from exograv.procedures.rehabilitation.guided.taught_path import make_taught_path, write_taught
from exograv.recording import read_recording
from exograv.runtime.clock.timing import LoopOutcome
from exograv.safety.guard import SafeState
from exograv.safety.stops import StopReason

pytestmark = pytest.mark.slow

AFTER_S = 6.0
"""Time after the arm is learned [s]: the weight is weighed, the therapist moves the arm, or the arm is gripped."""

SOFT_RAD_S = 1.0
"""Largest speed of a joint while a floating arm is let down [rad/s]."""

HAND_M_S = 1.0
"""Largest speed of a handle while an arm is let down that was in motion [m/s]: above it the fault campaign counts a
hand as too fast."""

WINDOW_S = 0.04
"""Time over which a speed is measured [s]; the encoders' steps vanish in it."""

COMMANDS = {
    "weigh": ("arm", "weigh", "recupera_like", "--hand-weight", "1"),
    "teach": ("run", "teach", "recupera_like"),
    "repeat": ("run", "repeat", "recupera_like", "--path", "taught.toml"),
    "mirror": ("run", "mirror", "recupera_like_dual"),
}
CAUSES = {
    "ctrl-c": StopReason.STOP_PRESSED,
    "control-dies": StopReason.CONTROL_SILENT,
    "guard-stops": StopReason.DRIVE_FAULT,
}


def write_path(file: Path, description: RigDescription) -> None:
    """Write a path from the donning posture upwards."""
    start, (lower, upper) = description.donning_posture, description.workspace
    way = Passage.planned(start, 0.5 * (lower + upper), 0.4, 0.2, PERIOD_S)
    path = ShapedPath(np.array([way.at(k)[0] for k in range(len(way))]), 1.0)
    write_taught(file, make_taught_path(path, description, "", datetime.now(UTC).replace(microsecond=0), True))


def handles(description: RigDescription, q: np.ndarray) -> np.ndarray:
    """Return the places of the handles (tick, arm, 3), where known weights hang, at postures `q` (tick, joint) [m]."""
    tree = read_exoskeleton(description)
    symbols = ca.SX.sym("q", len(tree.joints))  # pyright: ignore[reportArgumentType]
    poses = body_poses(tree, symbols)
    mounts = [name for name in tree.frames if name.endswith("calibration_mount")]
    assert len(mounts) == len(description.arm_sides)
    places = ca.Function("places", [symbols], [ca.vertcat(*(frame_pose(tree, poses, name).p for name in mounts))])
    return np.array(places(q.T)).T.reshape(len(q), len(mounts), 3)


@pytest.mark.parametrize("ending", CAUSES)
@pytest.mark.parametrize("procedure", COMMANDS)
def test_a_procedure_that_is_ended_lets_the_arm_down_and_says_why(procedure: str, ending: str, tmp_path: Path):
    words, cause = COMMANDS[procedure], CAUSES[ending]
    description = load_rig(words[2])
    machine = ReadyMachine.made(tmp_path, description.name)
    write_path(tmp_path / "taught.toml", description)
    command = machine.command(*words, "--identify", "10")[3:]
    flight = [sys.executable, "-m", "tests.live.on_drives.ended_flight", ending, f"{AFTER_S}", description.joints[-1]]
    root = Path(__file__).parents[3]
    environment = os.environ | {"PYTHONPATH": os.pathsep.join([str(root), *sys.path])}
    process = subprocess.run(
        [*flight, *command], cwd=tmp_path, env=environment, text=True, stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE, stderr=subprocess.STDOUT, check=False,
    )  # fmt: skip
    said = " ".join(process.stdout.split())
    assert process.returncode == 1, process.stdout
    assert "Traceback" not in said
    assert "The machine was stopped before the procedure was complete." in said
    assert cause.value in said
    assert said.endswith(f"{LEFT}[]")
    recording = read_recording(tmp_path / "out" / f"{procedure}.mcap")
    assert recording.settings["command"] == "exograv run live"
    assert [one["text"] for one in recording.messages("/event") if one["kind"] == "stop"] == [cause.value]
    ticks = recording.ticks
    assert ticks["t"][-1] > AFTER_S
    stopped = int(np.flatnonzero(ticks["safe_state"] > SafeState.DESCENT)[0])
    step = round(1e3 * WINDOW_S / PERIOD_MS)
    q = ticks["q_measured"][stopped:]
    at = handles(description, q[np.isfinite(q).all(axis=1)])
    assert np.linalg.norm(at[step:] - at[:-step], axis=2).max() / WINDOW_S < HAND_M_S


def test_at_the_end_of_its_time_a_run_lets_the_floating_arm_down_counts_no_stop_and_replays_exactly(tmp_path: Path):
    machine = ReadyMachine.made(tmp_path, "recupera_like")
    found = machine.flown("run", "live", "recupera_like", "--identify", "10", "--seconds", "3")
    assert (found["latches"], found["outcome"]) == ([], LoopOutcome.COMPLETE.value)
    recording = read_recording(tmp_path / found["recording"])
    assert TIME_IS_OVER in [one["text"] for one in recording.messages("/event")]
    lowered = recording.ticks[recording.ticks["safe_state"] == SafeState.DESCENT + 1]
    assert len(lowered) > 1000 / PERIOD_MS
    apart = round(1000 * WINDOW_S / PERIOD_MS)
    q = lowered["q_measured"]
    assert np.abs(q[apart:] - q[:-apart]).max() / WINDOW_S < SOFT_RAD_S
    assert "to the last bit" in machine.replayed(recording.path)
