"""A replayed live run decides the same as the run, though control was late and missed measurements in it."""

from collections.abc import Mapping
from functools import partial
from multiprocessing import Pipe
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from exograv.cli.recordings.replaying import run_replay
from exograv.dynamics.machine import CalibratedMachine
from exograv.laboratory.cooperative_wearer import cooperative_machine
from exograv.laboratory.virtual_laboratory import VirtualLaboratory
from exograv.live.guard_job import GuardJob
from exograv.live.guard_process import GuardLoop
from exograv.live.live_control import LiveControl, LivePlan, guarded_rig
from exograv.live.live_flight import settings_of
from exograv.loop.replay.recorded_run import gaps
from exograv.loop.replay.what_if import ReplayOverrides
from exograv.model.assembly import Assembly
from exograv.procedures.identification.controller_knowledge import ControllerKnowledge
from exograv.procedures.identification.estimator_session import table_guess
from exograv.recording import RecordingWriter, read_recording
from exograv.recording.encoding import tick_dtype
from exograv.results import json_value
from exograv.runtime.control_loop.exchange import Channels, FeltLevel, answer_dtype, answered_to, state_dtype
from exograv.runtime.control_loop.guard_commands import ENDS, GuardLine
from exograv.runtime.processes.shared_memory import Mailbox, Ring
from exograv.runtime.recorder.recorder_process import (
    EVENT,
    PHASE,
    RING_EVENTS,
    RING_GUARDS,
    RING_TICKS,
    Inlet,
    guard_dtype,
    message_of,
)
from exograv.safety.guard import COMMAND_LIFE_S, GRAVITY_LEVEL_S
from exograv.safety.limits import PersonLimits
from exograv.safety.plausible import Features, LimbTable, PlausibleTable
from exograv.signals import JointState

from .conftest import LEVEL, SEED, nothing

FLOATS = 6100
"""Tick at which the arm floats, after a rest and a ramp."""

TICKS, STOP_AT = FLOATS + 900, FLOATS + 700
TOLD_AT, LEVEL_BEFORE, LEVEL_TOLD = FLOATS + 100, 0.2, 0.35  # The ramp takes 750 ticks, so the stop interrupts it.
LATE = (FLOATS + 200, FLOATS + 202, FLOATS + 500)
"""Measurements that control answers after the guard's time-out."""

MISSED = (FLOATS + 300, FLOATS + 301, FLOATS + 501)
"""Measurements that control never receives."""


class Forgetful(GuardLoop):
    """Guard loop whose control sometimes does not run in time."""

    control: LiveControl
    row: np.ndarray

    def _asked(self, believed: JointState, now: float, woken: int) -> np.void | None:
        state, row = self._state, self.row
        state["sequence"], state["now"], state["safe_state"] = believed.sequence, now, self._safe_state
        state["q"], state["current"] = believed.q, believed.current
        person = self._guard.envelope.person
        assert person is not None
        state["gravity_level"] = person.gravity_level
        if believed.sequence in MISSED:
            return None
        row["seen"] = answered_to(int(row["seen"]), believed.sequence - int(row["sequence"]))
        row["sequence"], row["valid_until"] = believed.sequence, now + COMMAND_LIFE_S
        self.control.answer(state.reshape(1)[0], row)
        return None if believed.sequence in LATE else row.reshape(1)[0]


@pytest.fixture(scope="module")
def plan(laboratory: VirtualLaboratory, assembly: Assembly, machine: CalibratedMachine) -> LivePlan:
    """Return a plan whose guard has a wide table, because the limits of the person are not tested here."""
    x = table_guess(assembly, machine)
    prepared = ControllerKnowledge(assembly, machine, x, 400.0)
    return LivePlan(
        laboratory.description,
        laboratory.form,
        prepared,
        wide_limits(),
        LEVEL_BEFORE,
        cooperative_machine(laboratory, SEED, prepared.t),
    )


def wide_limits() -> PersonLimits:
    nothing, wide, reach = np.zeros((4, Features(4, 2).count)), np.full(4, 20.0), np.full(4, 3.0)
    table = PlausibleTable((LimbTable((0, 1, 2, 3), 2, nothing, nothing),), wide, wide, wide)
    return PersonLimits(table, np.full(4, 30.0), -reach, reach)


@pytest.fixture(scope="module")
def lived(plan: LivePlan, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Run guard and control in turn, as in their processes."""
    joints = plan.description.joints
    n, path = len(joints), tmp_path_factory.mktemp("lived") / "live.mcap"
    states, answers = Mailbox(state_dtype(n)), Mailbox(answer_dtype(n))
    ticks, events, guards = Ring(tick_dtype(n), RING_TICKS), Ring(EVENT, RING_EVENTS), Ring(guard_dtype(n), RING_GUARDS)
    line = GuardLine()
    channels = Channels(n, states.name, answers.name, Inlet(n, ticks.name, events.name, guards.name), line.names)
    _word, end = Pipe()
    job = GuardJob(partial(guarded_rig, plan), channels, TICKS, LiveControl.mode_names)
    guarding = Forgetful(job, end, job.build())
    guarding.begin()
    guarding.control, guarding.row = LiveControl(plan.prepared, plan.gravity_level), np.zeros((), answer_dtype(n))
    told: list[tuple[float, float]] = []
    for period in range(TICKS):
        if period == TOLD_AT:
            told.append((guarding.rig.t, LEVEL_TOLD))
            line.send(FeltLevel(LEVEL_TOLD))
        if period == STOP_AT:
            line.send(ENDS)
        line.beat()
        guarding.tick(period)
    guarding.close()
    write(path, joints, settings_of(plan, {"disturbance_level": LEVEL}), ticks, events, told, guards=guards)
    for memory in (states, answers, ticks, events, guards, line):
        memory.close()
    return path


def write(
    path: Path,
    joints: tuple[str, ...],
    settings: Mapping[str, Any],
    ticks: Ring,
    events: Ring,
    told: list[tuple[float, float]],
    ramp_s: float = 0.0,
    guards: Ring | None = None,
) -> None:
    with RecordingWriter(path, joints, settings) as recording:
        for row in () if guards is None else guards.take():
            recording.write("/guard", float(row["t"]), message_of(row))
        for t, level in told:
            recording.write("/control", t, {"act": "level", "gravity_level": level, "ramp_s": ramp_s})
        for row in events.take():
            kind, text = row["kind"].decode(), row["text"].decode()
            if kind == PHASE:
                recording.write("/phase", float(row["t"]), {"name": text})
            else:
                recording.write("/event", float(row["t"]), {"kind": kind, "text": text})
        recording.ticks(ticks.take())


def replayed(path: Path, **instead: Any) -> dict[str, Any]:
    return json_value(run_replay(path, None, nothing, ReplayOverrides(**instead)))


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
    assert found["guard_states"] == {"equal": 4, "differ_s": [], "continued": 0}
    assert found["ok"]
    assert found["stops"]["recorded_s"] == [stop["t"] for stop in found["stops"]["replayed"]]
    assert found["stops"]["replayed"][-1]["cause"] == "Stop was pressed."


def test_a_level_that_was_asked_for_is_felt_by_a_ramp_that_a_stop_ends(lived: Path):
    ticks = read_recording(lived).ticks
    ticks = ticks[np.isfinite(ticks["gravity_level"])]  # Only ticks that control answered in time.
    levels, passed = ticks["gravity_level"], np.diff(ticks["sequence"].astype(int))
    assert levels[0] == LEVEL_BEFORE
    assert np.diff(levels).min() >= 0.0
    assert (np.diff(levels) <= 1.001 * passed * 0.001 / GRAVITY_LEVEL_S).all()
    assert levels[-1] == pytest.approx(LEVEL_BEFORE + (STOP_AT - TOLD_AT) * 0.001 / GRAVITY_LEVEL_S, abs=1e-3)


@pytest.mark.long
def test_a_replay_that_is_not_told_of_the_level_differs(lived: Path, tmp_path: Path):
    """The replay takes the level from the recording, not from the answers of control."""
    found = replayed(copied(lived, tmp_path / "a.mcap", keeps_control=False))
    assert found["bit_identical"] == {"tau_desired": False, "tau_commanded": False}


def copied(lived: Path, path: Path, lost: slice = slice(0), keeps_control: bool = True) -> Path:
    """Copy the recording without these ticks."""
    source = read_recording(lived)
    settings = {k: v for k, v in source.settings.items() if k not in ("schema_version", "joints")}
    with RecordingWriter(path, source.joints, settings) as recording:
        for message in source.messages("/control") if keeps_control else ():
            recording.write("/control", message["t"], {k: v for k, v in message.items() if k != "t"})
        for message in source.messages("/phase"):
            recording.write("/phase", message["t"], {"name": message["name"]})
        recording.ticks(np.delete(source.ticks, lost))
    return path


def test_lost_ticks_are_said_and_what_follows_agrees_again(lived: Path, tmp_path: Path):
    found = replayed(copied(lived, tmp_path / "a.mcap", slice(FLOATS + 400, FLOATS + 440)))
    assert [gap["lost"] for gap in found["gaps"]] == [40]
    assert max(found["difference_Nm"]["tau_commanded"]["max"]) < 0.5


def test_another_gravity_level_is_flown_by_control_and_guard(lived: Path):
    found = replayed(lived, gravity_level=1.0)
    assert max(found["difference_Nm"]["tau_commanded"]["max"]) > 1.0


@pytest.mark.parametrize(("passed", "after"), [(1, 0b1011), (2, 0b10101), (63, (0b101 << 63 | 1) % 2**64), (64, 1)])
def test_what_control_has_answered_to_is_remembered_by_its_distance(passed: int, after: int):
    assert answered_to(0b101, passed) == after


@pytest.mark.parametrize(("timing", "lost"), [([{"ticks_lost": 0}], 0), ([{"ticks_lost": 3}], 4), ([{}], 4), ([], 4)])
def test_where_no_tick_was_lost_a_missing_number_is_of_a_measurement_that_the_guard_did_not_see_either(
    timing: list[dict[str, int]], lost: int
):
    assert gaps(np.array([7, 8, 13, 13], np.uint32), timing).tolist() == [0, 0, lost, 0]
