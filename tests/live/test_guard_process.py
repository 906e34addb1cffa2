"""A guard lowers the arm when control is silent, still sleeps, and waits for an answer before it resets the latch."""

import contextlib
import time
from collections.abc import Iterator
from multiprocessing import Pipe

import numpy as np
import pytest

from exograv.live.guard_job import GIVEN_UP_AFTER, TIME_IS_OVER, GuardedRig, GuardJob, answer_by_ns
from exograv.live.guard_process import LOST_AFTER, GuardLoop
from exograv.recording.encoding import tick_dtype
from exograv.rig.drive_status import DriveStatus
from exograv.runtime.control_loop.exchange import (
    DRIFTED,
    STOP_PRESSED,
    TOLD_LEVEL,
    Channels,
    FeltLevel,
    PersonUpdate,
    answer_dtype,
    state_dtype,
)
from exograv.runtime.control_loop.guard_commands import QUIET_S, level_note
from exograv.runtime.control_loop.steering import LeaseCommand
from exograv.runtime.processes.shared_memory import Mailbox, Ring
from exograv.runtime.recorder.recorder_process import (
    EVENT,
    RING_EVENTS,
    RING_GUARDS,
    RING_TICKS,
    Inlet,
    guard_dtype,
)
from exograv.safety.envelope import Envelope
from exograv.safety.guard import Guard, SafeState
from exograv.safety.limits import Limits, PersonLimits
from exograv.safety.person import GuardedPerson
from exograv.safety.plausible import LimbTable, PlausibleTable
from exograv.safety.stops import StopReason
from exograv.signals import Command, JointState, TorqueSource

PERIOD_S = 0.001
LIMITS = Limits(np.array([30.0]), np.array([10.0]), descent_s=0.05)
DOWN = 100
"""Ticks after which the descent is over."""


class StandingRig:
    """Rig with a joint that never moves; it counts commands."""

    joints, period_s = ("elbow",), PERIOD_S

    def __init__(self):
        self.commands: list[Command] = []
        self.is_virtual = True
        self.power: list[str] = []

    def enable(self) -> None:
        self.power.append("on")

    def disable(self) -> None:
        self.power.append("off")

    def status(self) -> tuple[DriveStatus, ...]:
        return (DriveStatus(is_enabled=self.power[-1:] == ["on"]),)

    @property
    def t(self) -> float:
        return PERIOD_S * len(self.commands)

    def read(self) -> JointState:
        number = len(self.commands)
        return JointState(self.t, number, np.zeros(1), np.zeros(1), np.full(1, np.nan), TorqueSource.CURRENT)

    def write(self, command: Command) -> None:
        self.commands.append(command)

    def __enter__(self) -> "StandingRig":
        return self

    def __exit__(self, kind, error, trace) -> None:
        pass


class Table:
    """Tick of the guard with a control that answers on demand."""

    def __init__(self, guarding: GuardLoop, rig: StandingRig, guard: Guard, answers: Mailbox):
        self.guarding, self.rig, self.guard, self._answers = guarding, rig, guard, answers
        self.looks = 0
        self._read = guarding._answers.read
        guarding._answers.read = self._counted
        self._row = np.zeros((), answer_dtype(1))

    def tick(self, answers: bool) -> bool:
        if answers:
            number = len(self.rig.commands)
            self._row["sequence"], self._row["valid_until"] = number, self.rig.t + 0.005
            self._answers.write(self._row)
        self.looks = 0
        return self.guarding.tick(len(self.rig.commands))

    def _counted(self):
        self.looks += 1
        return self._read()


class Clock:
    """Clock that advances by sleep only, some microseconds more than requested."""

    now = 0

    def monotonic_ns(self) -> int:
        return self.now

    def sleep(self, seconds: float) -> None:
        self.now += round(1e9 * seconds) + 60_000


@pytest.fixture(params=[True])
def table(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> Iterator[Table]:
    monkeypatch.setattr("exograv.live.guard_process.time", Clock())
    rig = StandingRig()
    rig.is_virtual = request.param
    guard = Guard.of_machine(Envelope(LIMITS, PERIOD_S), PERIOD_S)
    with contextlib.ExitStack() as stack:
        made = [
            stack.enter_context(contextlib.closing(memory))
            for memory in (
                Mailbox(state_dtype(1)),
                Mailbox(answer_dtype(1)),
                Ring(tick_dtype(1), RING_TICKS),
                Ring(EVENT, RING_EVENTS),
                Ring(guard_dtype(1), RING_GUARDS),
            )
        ]
        states, answers, *inlet = (memory.name for memory in made)
        channels = Channels(1, states, answers, Inlet(1, *inlet))
        build = lambda: GuardedRig(rig, guard, np.ones(1))  # noqa: E731 - a function would be longer
        guards_end, _parents_end = Pipe()
        guarding = GuardLoop(GuardJob(build, channels, 1000, ("floating",)), guards_end, build())
        mailbox = made[1]
        assert isinstance(mailbox, Mailbox)
        yield Table(guarding, rig, guard, mailbox)
        guarding.close()


def test_an_arm_is_not_given_to_a_control_that_does_not_answer(table: Table):
    for _ in range(5):
        table.tick(answers=True)
    assert table.guard.envelope.stop is None
    for _ in range(3 * DOWN):
        table.tick(answers=False)
    assert table.guard.envelope.stop is StopReason.CONTROL_SILENT
    assert len(table.guarding._latches) == 1
    for _ in range(5):
        table.tick(answers=True)
    assert table.guard.envelope.stop is None
    assert table.guarding._safe_state is SafeState.NONE
    assert len(table.guarding._latches) == 1


def test_the_guard_begins_from_the_torque_of_the_tick_that_is_recorded_first(
    table: Table, monkeypatch: pytest.MonkeyPatch
):
    currents = iter([5.0, -5.0, -5.0])
    read = table.rig.read
    monkeypatch.setattr(table.rig, "read", lambda: read()._replace(current=np.array([next(currents)])))
    table.guarding.begin()
    steps = [(table.tick(answers=True), float(table.rig.commands[-1].tau[0]))[1] for _ in range(2)]
    step = LIMITS.torque_rate_max_Nm_per_s * PERIOD_S
    assert steps == pytest.approx([5.0 - step, 5.0 - 2 * step])


@pytest.mark.parametrize("table", [False], indirect=True)
def test_a_stop_of_a_real_machine_ends_the_run_when_the_arm_is_down_and_is_not_reset(table: Table):
    table.guarding.begin()
    assert table.rig.power == ["on"]
    for answers in (True, False, False, False, False):
        assert not table.tick(answers)
    ended = [table.tick(answers=True) for _ in range(2 * DOWN)]
    assert ended[-1]
    assert DOWN // 4 < ended.index(True) < 2 * DOWN
    assert table.guard.envelope.stop is StopReason.CONTROL_SILENT


def flown_to_the_end(table: Table) -> int:
    """Fly up to the end of the time of the run, then on until the loop ends; return the number of further ticks."""
    for _ in range(1000):
        assert not table.tick(answers=True)
    for k in range(2 * DOWN):
        if table.tick(answers=True):
            return k + 1
    return 0


@pytest.mark.parametrize("table", [False], indirect=True)
def test_at_the_end_of_the_time_of_a_run_a_real_machine_lets_the_arm_down_and_no_stop_is_counted(table: Table):
    table.guarding.begin()
    assert DOWN // 4 < flown_to_the_end(table) < 2 * DOWN
    assert table.guarding._latches == []
    assert TIME_IS_OVER in [row["text"].decode() for row in table.guarding._events.take()]


def test_a_twin_floats_on_at_the_end_of_the_time_of_a_run(table: Table):
    assert flown_to_the_end(table) == 0
    assert table.guard.envelope.stop is None


def test_a_control_that_answers_while_the_arm_comes_down_does_not_shorten_the_descent(table: Table):
    for answers in (True, False, False, False, False):
        table.tick(answers)
    for _ in range(DOWN // 4):
        table.tick(answers=True)
        assert table.guard.envelope.stop is StopReason.CONTROL_SILENT


def test_a_guard_that_has_given_control_up_waits_in_few_ticks_only_until_it_answers_again(table: Table):
    table.tick(answers=True)
    looks = []
    for _ in range(GIVEN_UP_AFTER + 80):
        table.tick(answers=False)
        looks.append(table.looks)
    assert min(looks[:GIVEN_UP_AFTER]) > 1
    assert sum(each > 1 for each in looks[GIVEN_UP_AFTER:]) <= 10
    table.tick(answers=True)
    table.tick(answers=False)
    assert table.looks > 1


@pytest.mark.parametrize(("period_us", "by_us"), [(500, 325), (1000, 650), (2000, 1650), (4000, 3650)])
def test_control_has_of_a_period_what_a_guard_does_not_need_to_write(period_us: int, by_us: int):
    assert answer_by_ns(1000 * period_us) == 1000 * by_us


@pytest.mark.parametrize(("period_us", "by_us"), [(500, 375), (1000, 850), (2000, 1850)])
def test_the_loop_in_c_waits_longer_for_control_because_it_writes_faster(period_us: int, by_us: int):
    assert answer_by_ns(1000 * period_us, is_native=True) == 1000 * by_us


def somebody() -> PersonLimits:
    nothing, wide = np.zeros((1, 3)), np.full(1, 30.0)
    plausible = PlausibleTable((LimbTable((0,), 1, nothing, nothing),), wide, wide, wide)
    return PersonLimits(plausible, wide, np.full(1, -3.0), np.full(1, 3.0))


def test_who_is_known_is_held_to_what_a_driven_arm_may_have_only_as_long_as_it_is_led_on(table: Table):
    table.guard.envelope.person = GuardedPerson(somebody(), 0.0)
    table.guard.envelope.person.drive(True)
    driven = []
    for word in (PersonUpdate(somebody()), somebody()):
        table.guarding.hearing.hear(word, table.rig.t)
        table.tick(answers=True)
        driven.append(table.guard.envelope.person.is_driven)
    assert driven == [True, False]
    assert int(table.guarding._state["persons"]) == 2


def told(table: Table, level: float) -> tuple[int, str]:
    """Send a gravity level to the guard; return the recorded bits of `acts` and the note."""
    table.guarding.hearing.hear(FeltLevel(level), table.rig.t)
    table.tick(answers=True)
    (row,), (*_, note) = table.guarding._ticks.take()[-1:], table.guarding._events.take()
    return int(row["acts"]), note["text"].decode()


def test_a_ramp_that_is_requested_in_small_steps_is_noted_with_its_first_and_its_last_level(table: Table):
    table.guard.envelope.person = GuardedPerson(somebody(), 0.0)
    steps = np.linspace(0.0, 1.0, 101)
    table.guarding.hearing.hear(LeaseCommand(time.monotonic_ns() + 10**12, None, "finish"), table.rig.t)
    for number, level in enumerate(steps):
        table.guarding.hearing.hear(FeltLevel(float(level), number=number), table.rig.t)
        for _ in range(20):
            table.tick(answers=True)
    for _ in range(round(2 * QUIET_S / PERIOD_S)):
        table.tick(answers=True)
    texts = [row["text"].decode() for row in table.guarding._events.take()]
    assert [text for text in texts if "by a ramp" in text] == [level_note(0.0, ""), level_note(1.0, "")]


def test_a_gravity_level_is_recorded_sent_to_control_and_refused_after_a_stop_even_after_its_reset(
    table: Table,
):
    table.guard.envelope.person = GuardedPerson(somebody(), 0.0)
    table.tick(answers=True)
    acts, note = told(table, 0.25)
    assert acts & TOLD_LEVEL
    assert note == "From here on, by a ramp: support 75 % (felt weight 25 %)."
    for _ in range(5):
        table.tick(answers=True)
    assert 0.0 < table.guarding._state["gravity_level"] == table.guard.envelope.person.gravity_level
    for answers in (False,) * 4 + (True,) * (3 * DOWN):
        table.tick(answers)
    assert table.guard.envelope.stop is None
    assert len(table.guarding._latches) == 1
    felt = table.guard.envelope.person.gravity_level
    acts, note = told(table, 0.75)
    assert not acts & TOLD_LEVEL
    assert "refused" in note
    table.tick(answers=True)
    assert table.guard.envelope.person.gravity_level == felt


def test_an_error_in_a_tick_becomes_a_descent_that_is_recorded_and_reported(
    table: Table, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
):
    for _ in range(5):
        table.tick(answers=True)

    def fail(*_: object, **__: object) -> None:
        raise IndexError("mode 99")

    monkeypatch.setattr(table.guarding.hearing, "listen", fail)
    clock, ended = Clock(), list[bool]()
    monkeypatch.setattr("exograv.live.guard_process.time", clock)
    for _ in range(2 * DOWN):
        clock.sleep(PERIOD_S)
        ended.append(table.tick(answers=True))
    assert ended[-1]
    assert table.guard.envelope.stop is StopReason.STOP_PRESSED
    assert ended.index(True) > DOWN // 4
    assert abs(table.rig.commands[ended.index(True)].tau).max() < 1e-9
    assert "mode 99" in table.guarding.failure
    assert "IndexError" in capfd.readouterr().err
    texts = [row["text"].decode() for row in table.guarding._events.take()]
    assert table.guarding.failure in texts
    # A replay needs the act, in the tick in which the descent begins.
    ticks = table.guarding._ticks.take()
    assert np.count_nonzero(ticks["acts"] & STOP_PRESSED) == 1
    assert (np.diff(ticks["monotonic"][ticks["safe_state"] > 1]) > 0.0).all()  # each tick has a time of its own


def test_a_machine_that_cannot_be_read_after_an_error_ends_the_run(table: Table, monkeypatch: pytest.MonkeyPatch):
    for _ in range(5):
        table.tick(answers=True)

    def fail() -> None:
        raise OSError("no network")

    monkeypatch.setattr(table.rig, "read", fail)
    for _ in range(LOST_AFTER - 1):
        assert not table.tick(answers=True)
    with pytest.raises(OSError, match="no network"):
        table.tick(answers=True)


def test_a_finding_of_the_drift_monitor_is_recorded_once_and_a_large_one_lowers_the_arm(table: Table):
    for level in (0, 1, 1, 1):
        table._row["drift"], table._row["drift_Nm"] = level, 0.6
        table.tick(answers=True)
    assert table.guard.envelope.stop is None
    table._row["drift"], table._row["drift_Nm"] = 2, 2.4
    for _ in range(5):
        table.tick(answers=True)
    assert table.guard.envelope.stop is StopReason.DRIFTED
    told = [row["text"].decode() for row in table.guarding._events.take() if row["kind"] == b"warning"]
    assert [size for size in ("+0.6 N", "+2.4 N") if size in " ".join(told)] == ["+0.6 N", "+2.4 N"]
    assert len(told) == 2
    assert np.count_nonzero(table.guarding._ticks.take()["acts"] & DRIFTED) == 1


def test_a_finding_at_a_joint_that_does_not_exist_changes_nothing(table: Table):
    table._row["drift"], table._row["drift_joint"] = 2, 7
    for _ in range(5):
        table.tick(answers=True)
    assert table.guard.envelope.stop is None
    assert not table.guarding.failure
