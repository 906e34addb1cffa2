"""A fast session equals one of the real task, and a second guard changes no torque of it."""

from functools import cache

import numpy as np
import pytest

from exograv.campaigns.virtual_study.conditions import condition_of
from exograv.campaigns.virtual_study.flight import FlownTouch
from exograv.campaigns.virtual_study.session_setup import (
    SessionSetup,
    TrainingKnowledge,
    flight_setup,
    prepare_training,
    training_setup,
)
from exograv.campaigns.virtual_study.session_simulation import ACT_TICKS, PASSED_S, SimulatedSession, WindowTimes
from exograv.laboratory.participant.habits import Habits
from exograv.laboratory.participant.touch_screen import SimulatedRoom
from exograv.laboratory.participant.virtual_participant import PointingPerson
from exograv.loop.arm_controller import ArmController
from exograv.loop.machine_limits import limits
from exograv.recording import RecordingWriter, read_recording
from exograv.rig.twin import Twin
from exograv.safety.envelope import Envelope
from exograv.safety.guard import ControlRequest, Guard
from exograv.signals import Command
from exograv.task.plan import TaskPlan
from exograv.task.protocol import first_windows, load_protocol

SEED = 1004


@cache
def prepared() -> TrainingKnowledge:
    return prepare_training(condition_of("ideal"), SEED, 2, lambda _text, _share: None)


def sitting_on(stage: SessionSetup, protocol: str, windows: int, day: int = 1) -> SimulatedSession:
    loaded, room = first_windows(load_protocol(protocol), windows), SimulatedRoom()
    target = room.on_panel(*room.target_px(loaded.settings.target))
    person = PointingPerson(
        stage.own, stage.worn_inertia, stage.surroundings, target, loaded.settings.pace.too_short.shape, SEED,
        ACT_TICKS * stage.twin.period_s, Habits(),
    )  # fmt: skip
    person.begin_day(day)
    return SimulatedSession(stage, TaskPlan(loaded, stage.exo, room.calibration), room, person, day)


def flown(day: int) -> tuple[FlownTouch, ...]:
    sitting = sitting_on(training_setup(prepared(), 1), "training", 1, day)
    sitting.fly(None, lambda _share: None)
    return tuple(sitting.touches)


class Watched(Twin):
    """Machine behind a second guard. The largest change by that guard is kept."""

    changed_Nm = 0.0
    stops = 0

    def watch(self, stage: SessionSetup) -> None:
        self.envelope = Envelope(limits(stage.laboratory.description), self.period_s)
        self.guard = Guard.of_machine(self.envelope, self.period_s, stage.actuators.gain.tolist(), True)
        self.actuators = stage.actuators

    def write(self, command: Command) -> None:
        state = self.read()
        self.guard.see(state, self.t)
        decided = self.guard.decide(ControlRequest(state.sequence, self.t + 0.005, command.tau), self.t)
        self.changed_Nm = max(self.changed_Nm, float(np.abs(decided.tau - command.tau).max()))
        self.stops += self.envelope.stop is not None
        super().write(command)


@pytest.mark.slow  # A guard runs beside every tick.
def test_a_second_guard_changes_no_torque_of_a_session_but_the_first_steps_towards_it():
    stage = training_setup(prepared(), 1)
    twin = stage.twin
    twin.__class__ = Watched
    assert isinstance(twin, Watched)
    twin.watch(stage)
    sitting = sitting_on(stage, "training", 1)
    assert isinstance(stage.controller, ArmController)
    # The twin begins in equilibrium, but the second guard begins at zero torque. Its rate limit lets the torque rise
    # here, before the person moves.
    stage.controller.mode.gravity_level = 0.0
    for _ in range(3000):
        state = twin.read()
        tau = stage.controller.step(state.q, np.zeros_like(state.q), sitting._feedback.reference)
        twin.write(Command(twin.t, state.sequence, twin.t + 0.005, tau, stage.actuators.current(tau)))
    twin.changed_Nm = 0.0
    sitting.fly(None, lambda _share: None)
    assert len(sitting.touches) >= 7
    assert twin.stops == sitting.stops == 0
    assert twin.changed_Nm < 1e-9


@pytest.mark.slow  # Three sessions run with every shape checked.
def test_the_same_day_gives_the_same_touches_and_another_day_others():
    first = flown(1)
    assert len(first) >= 7
    assert flown(1) == first
    assert flown(2) != first


@pytest.mark.long
def test_a_recording_holds_every_accepted_touch_and_no_gap_longer_than_a_step_of_a_rest(tmp_path):
    stage = flight_setup(SEED, 2, 0)
    sitting = sitting_on(stage, "flight", 1)
    path = tmp_path / "flight.mcap"
    with RecordingWriter(path, stage.twin.joints, {"rig": "recupera_like_passive", "command": "test"}) as recording:
        sitting.fly(recording, lambda _share: None)
    recorded = read_recording(path)
    touches = [m["record"] for m in recorded.messages("/task") if m["record"]["kind"] == "touch"]
    assert [t["deviation_px"] for t in touches if t["is_accepted"]] == [t.deviation_px for t in sitting.touches]
    t = recorded.ticks["t"]
    assert len(t) > 1000
    assert np.diff(t).min() > 0.0
    assert np.diff(t).max() <= PASSED_S + 0.03


def test_somebody_is_awake_from_before_a_window_until_after_it():
    times = WindowTimes(((100.0, 122.0), (280.0, 302.0)), 3.0)
    assert [times.is_awake(t) for t in (96.9, 97.0, 110.0, 124.0, 124.1, 277.0, 400.0)] == [
        False, True, True, True, False, True, False,
    ]  # fmt: skip
    assert times.until_awake(124.1) == pytest.approx(277.0 - 124.1)
    assert times.until_awake(300.0) == np.inf
