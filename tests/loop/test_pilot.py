"""No listener receives a measurement that the guard rejects, and the recording names the safe state."""

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from exograv import motion
from exograv.dynamics.actuator import ActuatorGain
from exograv.loop.pilot import Pilot
from exograv.loop.tick_sample import TickSample
from exograv.recording import RecordingWriter, read_recording
from exograv.safety.envelope import Envelope
from exograv.safety.guard import SafeState
from exograv.safety.limits import Limits
from exograv.signals import Command, JointState, Reference, TorqueSource

DT, BAD_TICK = 0.001, 50


@dataclass
class Standing:
    """Two joints that stand still, with one wrong encoder value in one tick."""

    bad: float
    joints: tuple[str, ...] = ("one", "two")
    period_s: float = DT
    ticks: int = 0
    commands: list[Command] = field(default_factory=list)

    @property
    def t(self) -> float:
        return self.ticks * DT

    def read(self) -> JointState:
        q = np.array([0.3, self.bad if self.ticks == BAD_TICK else 0.6])
        return JointState(self.t, self.ticks, q, np.zeros(2), np.full(2, np.nan), TorqueSource.CURRENT)

    def write(self, command: Command) -> None:
        self.commands.append(command)
        self.ticks += 1

    def __enter__(self) -> "Standing":
        return self

    def __exit__(self, kind: Any, error: Any, trace: Any) -> None:
        pass


class Carrying:
    tau_feedforward, closure_slope, clearance = np.zeros(2), 0.0, 1.0

    def step(self, q: np.ndarray, v: np.ndarray, reference: Reference) -> np.ndarray:
        assert np.isfinite(q).all(), "control answers only measurements that the guard accepts"
        return np.array([0.1, 0.2])


@pytest.mark.parametrize("bad", [np.nan, np.inf, 5.0])
def test_a_measurement_that_is_not_believed_reaches_no_listener_and_moves_no_torque(tmp_path: Path, bad: float):
    rig, heard = Standing(bad), list[int]()
    limits = Limits(np.array([30.0, 20.0]), np.array([10.0, 4.0]))
    gain = ActuatorGain(np.ones(2), np.full(2, 0.001))

    def listen(moment: TickSample) -> None:
        heard.append(moment.state.sequence)
        np.testing.assert_allclose(moment.state.q, [0.3, 0.6])

    with RecordingWriter(tmp_path / "run.mcap", rig.joints, {}) as recording:
        pilot = Pilot(rig, gain, Envelope(limits, DT), recording)
        pilot.run(Carrying(), motion.hold(np.array([0.3, 0.6]), 100 * DT, DT), "", listen)
    # In its place listeners hear the motion between its neighbours.
    assert heard == [tick + (tick == BAD_TICK) for tick in range(len(rig.commands))]
    np.testing.assert_array_equal(rig.commands[BAD_TICK].tau, rig.commands[BAD_TICK - 1].tau)
    ticks = read_recording(tmp_path / "run.mcap").ticks
    bridged = np.flatnonzero(ticks["safe_state"] == SafeState.BRIDGE + 1)
    np.testing.assert_array_equal(bridged, [BAD_TICK])
    assert np.isnan(ticks["tau_desired"][BAD_TICK]).all()
    np.testing.assert_array_equal(ticks["sequence"], np.arange(len(rig.commands)))


class Stepping(Standing):
    """Machine whose every measurement is a step, as simulated drives that wait for the computer."""

    def read(self) -> JointState:
        self.ticks += 1
        return super().read()

    def write(self, command: Command) -> None:
        self.commands.append(command)


def test_a_phase_that_begins_takes_no_measurement_of_its_own(tmp_path: Path):
    # A measurement without a tick is missing in the recording, and a replay would restart its filters there.
    rig = Stepping(bad=0.6)
    envelope = Envelope(Limits(np.full(2, 50.0), np.full(2, 5.0)), DT)
    with RecordingWriter(tmp_path / "a.mcap", rig.joints, {}) as recording:
        pilot = Pilot(rig, ActuatorGain(np.ones(2), np.full(2, 0.01)), envelope, recording)
        for phase in ("first", "second", "third"):
            pilot.begin(phase)
            pilot.run(Carrying(), motion.hold(np.array([0.3, 0.6]), 0.02, DT), phase)
    ticks = read_recording(tmp_path / "a.mcap").ticks
    assert (np.diff(ticks["sequence"].astype(int)) == 1).all()
    assert sorted(set(ticks["phase"].tolist())) == [1, 2, 3]
