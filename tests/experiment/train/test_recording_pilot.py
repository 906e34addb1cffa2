"""A fast arm does not end the session of a machine without torque."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from exograv import motion
from exograv.dynamics.actuator import ActuatorGain
from exograv.errors import RigError
from exograv.experiment.train.recording_pilot import RecordingPilot
from exograv.loop.machine_limits import WITHOUT_MOTOR_NM
from exograv.loop.pilot import Pilot
from exograv.recording import RecordingWriter, read_recording
from exograv.safety.envelope import Envelope
from exograv.safety.limits import Limits
from exograv.signals import Command, JointState, Reference, TorqueSource

DT, FAST_FROM, FAST_UNTIL, V_FAST = 0.001, 300, 500, 7.0


@dataclass
class Swinging:
    """Machine with one joint that is thrown for 0.2 s, and stands still before and after."""

    joints: tuple[str, ...] = ("one",)
    period_s: float = DT
    ticks: int = 0
    torque: float = 0.0

    @property
    def t(self) -> float:
        return self.ticks * DT

    def read(self) -> JointState:
        q = V_FAST * DT * np.clip(self.ticks - FAST_FROM, 0, FAST_UNTIL - FAST_FROM)
        return JointState(self.t, self.ticks, np.array([q]), np.zeros(1), np.full(1, np.nan), TorqueSource.CURRENT)

    def write(self, command: Command) -> None:
        self.torque = max(self.torque, float(np.abs(command.tau).max()))
        self.ticks += 1

    def __enter__(self) -> "Swinging":
        return self

    def __exit__(self, kind: Any, error: Any, trace: Any) -> None:
        pass


class Idle:
    tau_feedforward, closure_slope, clearance = np.zeros(1), 0.0, 1.0

    def step(self, q: np.ndarray, v: np.ndarray, reference: Reference) -> np.ndarray:
        return np.zeros(1)


def flown(kind: type[Pilot], path: Path) -> Swinging:
    rig = Swinging()
    with RecordingWriter(path, rig.joints, {}) as recording:
        envelope = Envelope(Limits(np.array([WITHOUT_MOTOR_NM]), np.array([10.0])), DT)
        pilot = kind(rig, ActuatorGain(np.ones(1), np.zeros(1)), envelope, recording, lambda _text, _share: None)
        pilot.begin("task")
        pilot.run(Idle(), motion.hold(np.zeros(1), 6.0, DT), "")
    return rig


def test_a_fast_arm_is_noted_once_and_the_recording_goes_on(tmp_path: Path):
    path = tmp_path / "flight.mcap"
    rig = flown(RecordingPilot, path)
    recording = read_recording(path)
    assert len(recording.ticks) == rig.ticks == 6000
    notes = [event for event in recording.messages("/event") if event["kind"] == "warning"]
    assert len(notes) == 1
    assert "No motor is active" in notes[0]["text"]
    assert recording.ticks["safe_state"][-1] == 0, "the latch was left as soon as the arm stood"
    assert rig.torque <= WITHOUT_MOTOR_NM


def test_the_same_arm_stops_a_machine_that_drives_it(tmp_path: Path):
    with pytest.raises(RigError, match="faster than allowed"):
        flown(Pilot, tmp_path / "driven.mcap")
