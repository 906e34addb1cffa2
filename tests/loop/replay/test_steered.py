"""A replayed session that an operator steered decides the same, because every command is in the recording."""

from dataclasses import replace
from functools import partial
from multiprocessing import Pipe
from pathlib import Path

import numpy as np
import pytest

from exograv.dynamics.machine import CalibratedMachine
from exograv.laboratory.attentive_wearer import attentive_twin
from exograv.laboratory.cooperative_wearer import cooperative_machine
from exograv.laboratory.virtual_laboratory import VirtualLaboratory
from exograv.live.guard_job import GuardJob
from exograv.live.guard_process import GuardLoop
from exograv.live.live_control import LiveControl, LivePlan, guarded_rig
from exograv.live.live_flight import settings_of
from exograv.model.assembly import Assembly
from exograv.procedures.identification.controller_knowledge import ControllerKnowledge
from exograv.procedures.identification.estimator_session import table_guess
from exograv.recording import read_recording
from exograv.recording.encoding import tick_dtype
from exograv.runtime.control_loop.exchange import EVENT_SHIFT, Channels, FeltLevel, answer_dtype, state_dtype
from exograv.runtime.control_loop.steering import ASKABLE, DescentCommand, GuardRequest, LeaseCommand
from exograv.runtime.processes.shared_memory import Mailbox, Ring
from exograv.runtime.recorder.recorder_process import (
    EVENT,
    RING_EVENTS,
    RING_GUARDS,
    RING_TICKS,
    Inlet,
    guard_dtype,
)
from exograv.safety.guard import COMMAND_LIFE_S
from exograv.safety.modes import Event
from exograv.signals import JointState

from .conftest import LEVEL, SEED
from .test_live_replay import replayed, wide_limits, write

pytestmark = pytest.mark.slow

LEVEL_AT, LEVEL_TOLD, RAMP_S = 600, 0.3, 8.0
WORDS = {
    20: GuardRequest(1, Event.TEST),
    40: GuardRequest(2, Event.TAKE_ARM),
    LEVEL_AT: FeltLevel(LEVEL_TOLD, RAMP_S, 3),
    800: GuardRequest(4, Event.GIVE_BACK),
    1500: DescentCommand(5),
    5200: GuardRequest(6, Event.RESET),
    5250: GuardRequest(7, Event.TEST),
}
TICKS = 5300


class Clock:
    now = 0

    def monotonic_ns(self) -> int:
        return self.now


class InTurn(GuardLoop):
    """Guard loop that runs control in turn with the guard."""

    control: LiveControl
    row: np.ndarray

    def _asked(self, believed: JointState, now: float, woken: int) -> np.void | None:
        state, row, person = self._state, self.row, self._guard.envelope.person
        assert person is not None
        state["sequence"], state["now"], state["safe_state"] = believed.sequence, now, self._safe_state
        state["q"], state["current"], state["gravity_level"] = believed.q, believed.current, person.gravity_level
        self.hearing.tell(state)
        row["sequence"], row["valid_until"], row["seen"] = believed.sequence, now + COMMAND_LIFE_S, 1
        self.control.answer(state.reshape(1)[0], row)
        self.hearing.delivered()
        return row.reshape(1)[0]


@pytest.fixture(scope="module")
def steered(
    laboratory: VirtualLaboratory,
    assembly: Assembly,
    machine: CalibratedMachine,
    tmp_path_factory: pytest.TempPathFactory,
) -> Path:
    prepared = ControllerKnowledge(assembly, machine, table_guess(assembly, machine), 400.0)
    plan = LivePlan(
        laboratory.description,
        laboratory.form,
        prepared,
        wide_limits(),
        0.0,
        cooperative_machine(laboratory, SEED, prepared.t),
    )
    plan = replace(plan, machine=partial(attentive_twin, laboratory, SEED, 400.0), is_steered=True)
    joints, path = plan.description.joints, tmp_path_factory.mktemp("steered") / "live.mcap"
    n = len(joints)
    states, answers = Mailbox(state_dtype(n)), Mailbox(answer_dtype(n))
    ticks, events, guards = Ring(tick_dtype(n), RING_TICKS), Ring(EVENT, RING_EVENTS), Ring(guard_dtype(n), RING_GUARDS)
    channels = Channels(n, states.name, answers.name, Inlet(n, ticks.name, events.name, guards.name))
    _ours, theirs = Pipe()
    job = GuardJob(partial(guarded_rig, plan), channels, TICKS, LiveControl.mode_names, is_steered=True)
    with pytest.MonkeyPatch.context() as patch:
        clock = Clock()
        patch.setattr("exograv.runtime.control_loop.guard_commands.time", clock)
        guarding = InTurn(job, theirs, job.build())
        guarding.begin()
        guarding.control, guarding.row = LiveControl(prepared, 0.0, is_steered=True), np.zeros((), answer_dtype(n))
        told: list[tuple[float, float]] = []
        for period in range(TICKS):
            clock.now = 1_000_000 * period
            guarding.tick(period)
            mode = guarding._known_modes[guarding._mode]
            for word in (LeaseCommand(10**18) if period % 200 == 0 else None, WORDS.get(period)):
                if isinstance(word, FeltLevel):
                    told.append((guarding.rig.t, LEVEL_TOLD))
                if word is not None:
                    guarding.hearing.hear(word, guarding.rig.t, mode)
    guarding.close()
    write(path, joints, settings_of(plan, {"disturbance_level": LEVEL}), ticks, events, told, RAMP_S)
    for memory in (states, answers, ticks, events, guards):
        memory.close()
    return path


def test_each_event_is_in_the_tick_in_which_control_was_told(steered: Path):
    acts = read_recording(steered).ticks["acts"]
    told = [(int(k), ASKABLE[(code >> EVENT_SHIFT) - 1]) for k, code in enumerate(acts) if code >> EVENT_SHIFT]
    assert told == [
        (21, Event.TEST),
        (22, Event.PASSED),
        (41, Event.TAKE_ARM),
        (801, Event.GIVE_BACK),
        (5202, Event.RESET),
        (5251, Event.TEST),
        (5252, Event.PASSED),
    ]


def test_the_modes_are_those_that_were_asked_for(steered: Path):
    names = [phase["name"] for phase in read_recording(steered).messages("/phase")]
    assert names == [
        "off", "self_test", "exo_only", "ramp_in", "ramp_out", "safe", "off", "self_test", "exo_only",
    ]  # fmt: skip


def test_a_level_comes_by_the_ramp_that_was_asked_for(steered: Path):
    levels = read_recording(steered).ticks["gravity_level"]
    assert levels[LEVEL_AT] == 0.0
    assert levels[LEVEL_AT + 800] == pytest.approx(LEVEL_TOLD * 0.8 / RAMP_S, abs=1e-3)


def test_every_torque_is_the_recorded_one_to_the_last_bit(steered: Path):
    found = replayed(steered)
    assert found["bit_identical"] == {"tau_desired": True, "tau_commanded": True}
    assert found["safe_state_differs"]["ticks"] == 0
    assert found["compared"]["tau_commanded"] == TICKS
