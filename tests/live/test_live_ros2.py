"""A live run with a bridge to ROS 2 reaches its end, and the guard decides about a gravity level from ROS 2."""

import json
import socket
import subprocess
import sys
import threading
from pathlib import Path

import numpy as np
import pytest

from exograv.live.guard_job import GuardedRig
from exograv.live.live_processes import ProcessParts, Running, fly
from exograv.recording import read_recording
from exograv.rig import Rig
from exograv.runtime.control_loop.guard_commands import STOPPED_BEFORE, level_note
from exograv.runtime.recorder.recorder import Recorder
from exograv.runtime.ros2.bridge import WANTED
from exograv.runtime.ros2.bridging import Bridging, Ros2
from exograv.runtime.ros2.keys import topic_key
from exograv.runtime.ros2.messages import FLOAT64, float64
from exograv.safety.envelope import Envelope
from exograv.safety.guard import Guard
from exograv.safety.limits import Limits, PersonLimits
from exograv.safety.person import GuardedPerson
from exograv.safety.plausible import LimbTable, PlausibleTable
from exograv.signals import Command, JointState, TorqueSource

pytest.importorskip("zenoh")

PERIOD_S, SECONDS = 0.01, 6.0
PEER = Path(__file__).parents[1] / "runtime" / "ros2" / "peer.py"


class StandingRig:
    """Rig with a joint that never moves."""

    joints, period_s, is_virtual = ("elbow",), PERIOD_S, True

    def __init__(self):
        self._number = 0

    @property
    def t(self) -> float:
        return PERIOD_S * self._number

    def read(self) -> JointState:
        number = self._number
        return JointState(self.t, number, np.zeros(1), np.zeros(1), np.full(1, np.nan), TorqueSource.CURRENT)

    def write(self, command: Command) -> None:
        self._number += 1

    def __enter__(self) -> "StandingRig":
        return self

    def __exit__(self, kind, error, trace) -> None:
        pass


class Idle:
    """Control that requests no torque, and answers with the gravity level that it was given."""

    mode_names = ("floating",)

    def answer(self, state: np.void, row: np.ndarray) -> None:
        row["v"], row["tau"], row["gravity_level"] = 0.0, 0.0, state["gravity_level"]


def guarded() -> GuardedRig:
    nothing, wide = np.zeros((1, 3)), np.full(1, 30.0)
    table = PlausibleTable((LimbTable((0,), 1, nothing, nothing),), wide, wide, wide)
    envelope = Envelope(Limits(np.array([30.0]), np.array([10.0])), PERIOD_S)
    envelope.person = GuardedPerson(PersonLimits(table, wide, np.full(1, -3.0), np.full(1, 3.0)), 0.0)
    rig: Rig = StandingRig()
    return GuardedRig(rig, Guard.of_machine(envelope, PERIOD_S), np.ones(1))


@pytest.mark.slow
def test_a_run_is_told_to_ros_2_to_its_end_and_the_guard_answers_what_was_asked_for(tmp_path: Path):
    with socket.socket() as free:
        free.bind(("localhost", 0))
        port = free.getsockname()[1]
    pipe, program = subprocess.PIPE, [sys.executable, str(PEER), str(port)]
    with subprocess.Popen(program, text=True, stdin=pipe, stdout=pipe) as peer:
        assert peer.stdin is not None
        assert peer.stdout is not None
        assert "ready" in peer.stdout.readline()
        heard: list[dict] = []
        reading = threading.Thread(target=lambda: heard.extend(json.loads(line) for line in peer.stdout or ()))
        reading.start()
        bridging = Bridging(Ros2(f"tcp/localhost:{port}", accepts_level=True, domain=0), ("elbow",))

        def ask(_: Running) -> None:
            print(topic_key(0, WANTED, FLOAT64), float64(0.5).hex(), file=peer.stdin, flush=True)

        parts = ProcessParts(guarded, Idle, Idle, Idle.mode_names, period_ns=round(1e9 * PERIOD_S))
        with Recorder(tmp_path / "a.mcap", ("elbow",), {"rig": "none"}, SECONDS) as recorder:
            flown = fly(parts, SECONDS, recorder, lambda *_: None, ask, ros2=bridging)
        peer.stdin.close()
        reading.join()
    figures = bridging.figures()
    states = [one for one in heard if one.get("key", "").startswith("0/joint_states/")]
    assert len(states) > 0.9 * (figures.joint_states or 0) > 0
    assert figures.ended == ""
    recording = read_recording(flown.path)
    levels = [m["gravity_level"] for m in recording.messages("/control") if m["act"] == "level"]
    assert levels == [0.5]
    notes = [message["text"] for message in recording.messages("/event") if message["kind"] == "note"]
    taken = level_note(0.5, "") in notes
    assert taken or level_note(0.5, STOPPED_BEFORE) in notes
    levels = recording.ticks["gravity_level"]
    assert taken == bool(np.nanmax(levels) > 0.0)
