"""A live run decides the same when it is flown again, though control was late, and missed measurements, in it."""

from functools import partial
from multiprocessing import Pipe
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from exograv.dynamics.machine import CalibratedMachine
from exograv.model.assembly import Assembly
from exograv.recording import RecordingWriter, read_recording
from exograv.recording.encoding import tick_dtype
from exograv.runtime import live
from exograv.runtime.exchange import Channels, answer_dtype, answered_to, state_dtype
from exograv.runtime.live import GuardJob
from exograv.runtime.recorder_process import EVENT, PHASE, RING_EVENTS, RING_TICKS, Inlet
from exograv.runtime.shared import Mailbox, Ring
from exograv.safety.guard import COMMAND_LIFE_S
from exograv.safety.person import PersonLimits
from exograv.safety.plausible import Chain, Features, PlausibleTable
from exograv.session.learner import table_guess
from exograv.session.live import settings_of
from exograv.session.live_control import LiveControl, Plan, guarded_rig
from exograv.session.prepare import Prepared
from exograv.session.replay.instead import Instead
from exograv.session.replay.run import ReplayOptions, run_replay
from exograv.session.virtual import VirtualLaboratory
from exograv.signals import JointState

from .conftest import LEVEL, SEED, nothing

FLOATS = 6100
"""After a rest and a ramp."""

TICKS, STOP_AT = FLOATS + 900, FLOATS + 700
LATE = (FLOATS + 200, FLOATS + 202, FLOATS + 500)
"""Measurements that control answers to when the guard has given up waiting."""

MISSED = (FLOATS + 300, FLOATS + 301, FLOATS + 501)
"""Measurements that control never gets to see."""


class Forgetful(live._Guarding):
    """A guard whose control is forgotten by the computer now and then."""

    control: LiveControl
    row: np.ndarray

    def _asked(self, believed: JointState, now: float, woken: int) -> np.void | None:
        state, row = self._state, self.row
        state["sequence"], state["now"], state["safe_state"] = believed.sequence, now, self._safe_state
        state["q"], state["current"] = believed.q, believed.current
        if believed.sequence in MISSED:
            return None
        row["seen"] = answered_to(int(row["seen"]), believed.sequence - int(row["sequence"]))
        row["sequence"], row["valid_until"] = believed.sequence, now + COMMAND_LIFE_S
        self.control.answer(state.reshape(1)[0], row)
        return None if believed.sequence in LATE else row.reshape(1)[0]


@pytest.fixture(scope="module")
def plan(laboratory: VirtualLaboratory, assembly: Assembly, machine: CalibratedMachine) -> Plan:
    """The guard's table is a wide one: what it holds a person to is not looked at here."""
    x = table_guess(assembly, machine)
    prepared = Prepared(assembly, machine, x, 400.0)
    return Plan.of_twin(laboratory, prepared, wide_limits(), SEED, 0.2)


def wide_limits() -> PersonLimits:
    nothing, wide, reach = np.zeros((4, Features(4, 2).count)), np.full(4, 20.0), np.full(4, 3.0)
    table = PlausibleTable((Chain((0, 1, 2, 3), 2, nothing, nothing),), wide, wide, wide)
    return PersonLimits(table, np.full(4, 30.0), -reach, reach)


@pytest.fixture(scope="module")
def lived(plan: Plan, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Guard and control as in their processes, but in turn."""
    joints = plan.description.joints
    n, path = len(joints), tmp_path_factory.mktemp("lived") / "live.mcap"
    states, answers = Mailbox(state_dtype(n)), Mailbox(answer_dtype(n))
    ticks, events = Ring(tick_dtype(n), RING_TICKS), Ring(EVENT, RING_EVENTS)
    channels = Channels(n, states.name, answers.name, Inlet(n, ticks.name, events.name))
    word, end = Pipe()
    guarding = Forgetful(GuardJob(partial(guarded_rig, plan), channels, TICKS, LiveControl.mode_names), end)
    guarding.begin()
    guarding.control, guarding.row = LiveControl(plan.prepared, plan.gravity_level), np.zeros((), answer_dtype(n))
    for period in range(TICKS):
        if period == STOP_AT:
            word.send("stop")
        guarding.tick(period)
    guarding.close()
    write(path, joints, settings_of(plan, {"disturbance_level": LEVEL}), ticks, events)
    for memory in (states, answers, ticks, events):
        memory.close()
    return path


def write(path: Path, joints: tuple[str, ...], settings: dict[str, Any], ticks: Ring, events: Ring) -> None:
    with RecordingWriter(path, joints, settings) as recording:
        for row in events.take():
            kind, text = row["kind"].decode(), row["text"].decode()
            if kind == PHASE:
                recording.write("/phase", float(row["t"]), {"name": text})
            else:
                recording.write("/event", float(row["t"]), {"kind": kind, "text": text})
        recording.ticks(ticks.take())


def replayed(path: Path, **instead: Any) -> dict[str, Any]:
    return run_replay(ReplayOptions(path, Instead(**instead)), None, nothing)


def test_every_torque_is_the_recorded_one_to_the_last_bit_and_the_stop_comes_again_in_its_tick(lived: Path):
    ticks = read_recording(lived).ticks
    assert ticks["sequence"][ticks["seen"] == 0].tolist() == sorted(LATE + MISSED)
    assert ticks["seen"][FLOATS + 302] & 0b111 == 0b001
    assert ticks["seen"][FLOATS + 502] & 0b111 == 0b101
    found = replayed(lived)
    assert found["bit_identical"] == {"tau_desired": True, "tau_commanded": True}
    assert found["first_difference"] is None
    assert found["safe_state_differs"]["ticks"] == 0
    assert found["compared"]["tau_commanded"] == TICKS
    assert found["ok"]
    assert found["stops"]["recorded_s"] == [stop["t"] for stop in found["stops"]["replayed"]]
    assert found["stops"]["replayed"][-1]["cause"] == "Stop was pressed."


def test_lost_ticks_are_said_and_what_follows_agrees_again(lived: Path, tmp_path: Path):
    source = read_recording(lived)
    settings = {k: v for k, v in source.settings.items() if k not in ("schema_version", "joints")}
    with RecordingWriter(tmp_path / "a.mcap", source.joints, settings) as recording:
        for message in source.messages("/phase"):
            recording.write("/phase", message["t"], {"name": message["name"]})
        recording.ticks(np.delete(source.ticks, np.r_[FLOATS + 400 : FLOATS + 440]))
    found = replayed(tmp_path / "a.mcap")
    assert [gap["lost"] for gap in found["gaps"]] == [40]
    assert max(found["difference_Nm"]["tau_commanded"]["max"]) < 0.5


def test_another_gravity_level_is_flown_by_control_and_guard(lived: Path):
    found = replayed(lived, gravity_level=1.0)
    assert max(found["difference_Nm"]["tau_commanded"]["max"]) > 1.0


@pytest.mark.parametrize(("passed", "after"), [(1, 0b1011), (2, 0b10101), (63, (0b101 << 63 | 1) % 2**64), (64, 1)])
def test_what_control_has_answered_to_is_remembered_by_its_distance(passed: int, after: int):
    assert answered_to(0b101, passed) == after
