"""The guard takes a message in its next tick, executes it if allowed, and replies."""

import contextlib
import errno
import os
import struct
from collections.abc import Iterator
from dataclasses import dataclass, field
from multiprocessing import Pipe
from multiprocessing.connection import Connection

import numpy as np
import pytest

from exograv.runtime.control_loop.exchange import (
    CONSENTED,
    EVENT_SHIFT,
    RESET,
    STOP_PRESSED,
    TOLD_LEVEL,
    TOLD_PERSON,
    Consent,
    FeltLevel,
    PersonUpdate,
    state_dtype,
)
from exograv.runtime.control_loop.guard_commands import (
    AGREED,
    ASK_PARENT_EVERY,
    ENDS,
    NOT_AGREED,
    NOT_TAKEN,
    PARENT_GONE,
    PARENT_SILENT,
    PARENT_SILENT_S,
    PERSON_KNOWN,
    PULSE,
    QUIET_S,
    STOPPED_BEFORE,
    GuardCommands,
    GuardInbox,
    GuardLine,
    level_note,
)
from exograv.runtime.control_loop.steering import ASKABLE, DescentCommand, GuardReply, GuardRequest, LeaseCommand
from exograv.runtime.processes.shared_memory import Mailbox, MessageRing
from exograv.safety.envelope import Envelope
from exograv.safety.guard import ControlRequest, Guard, SafeState
from exograv.safety.limits import Limits, PersonLimits
from exograv.safety.modes import Event, Mode
from exograv.safety.person import GuardedPerson
from exograv.safety.plausible import LimbTable, PlausibleTable
from exograv.safety.stops import StopReason
from exograv.signals import JointState, TorqueSource

PERIOD_S, FAR = 0.001, 10**18
LIMITS = Limits(np.array([30.0]), np.array([10.0]), descent_s=0.05)
DOWN = 100
"""Ticks after which the descent is over."""


class Clock:
    now = 0

    @classmethod
    def monotonic_ns(cls) -> int:
        return cls.now


@dataclass
class Room:
    """Guard with its messages and its parent."""

    guard: Guard
    hearing: GuardCommands
    line: GuardLine
    ours: Connection
    notes: list[str]
    mode: Mode | None = Mode.OFF
    answers: bool = True
    period: int = 1  # not a period in which it looks at the line without the bell
    state: np.ndarray = field(default_factory=lambda: np.zeros((), state_dtype(1)))

    def tick(self) -> None:
        """Run a tick as in the guard's process."""
        now, self.period = PERIOD_S * self.period, self.period + 1
        measured = JointState(now, self.period, np.zeros(1), np.zeros(1), np.full(1, np.nan), TorqueSource.CURRENT)
        self.guard.see(measured, now)
        was_stopped = self.guard.envelope.stop is not None
        self.state["safe_state"] = SafeState.DESCENT if was_stopped else SafeState.NONE
        self.hearing.tell(self.state)
        if self.answers:
            self.hearing.delivered()
        self.guard.decide(ControlRequest(self.period, now + 0.005, np.zeros(1)) if self.answers else None, now)
        if self.guard.envelope.stop is not None and not was_stopped:
            self.hearing.latched()
        self.hearing.acts = 0
        self.hearing.listen(self.period, now, self.mode, is_answered=self.answers)

    def says(self, word: object) -> str | None:
        """Send a message, run a tick, and return the guard's reason of refusal; None without a reply."""
        self.line.send(word)
        self.tick()
        heard = next(self.line.replies(), None)
        return heard.why if isinstance(heard, GuardReply) else None

    @property
    def told(self) -> Event | None:
        """Event that control was told in the last tick, as the next one records it."""
        code = self.hearing.acts >> EVENT_SHIFT
        return ASKABLE[code - 1] if code else None


@pytest.fixture
def room(monkeypatch: pytest.MonkeyPatch) -> Iterator[Room]:
    monkeypatch.setattr(Clock, "now", 0)
    monkeypatch.setattr("exograv.runtime.control_loop.guard_commands.time", Clock)
    guard = Guard.of_machine(Envelope(LIMITS, PERIOD_S), PERIOD_S)
    nothing, wide = np.zeros((1, 3)), np.full(1, 30.0)
    table = PlausibleTable((LimbTable((0,), 1, nothing, nothing),), wide, wide, wide)
    guard.envelope.person = GuardedPerson(PersonLimits(table, wide, np.full(1, -3.0), np.full(1, 3.0)), 0.0)
    ours, theirs = Pipe()
    with contextlib.closing(GuardLine()) as line, contextlib.closing(ours), contextlib.closing(theirs):
        notes: list[str] = []
        with contextlib.closing(GuardInbox(line.names, theirs)) as inbox:
            yield Room(guard, GuardCommands(guard, inbox, lambda _t, text: notes.append(text)), line, ours, notes)


def lease(room: Room) -> None:
    assert room.says(LeaseCommand(FAR)) is None


def test_stop_is_executed_in_the_next_tick_with_any_lease(room: Room):
    room.tick()
    assert room.says(DescentCommand(7)) == ""
    assert room.guard.envelope.stop is StopReason.STOP_PRESSED
    assert room.hearing.acts == STOP_PRESSED
    assert not room.hearing.is_asked_to_end
    assert room.notes == ["operator: stop: done."]


def test_messages_are_taken_in_order_one_per_tick(room: Room):
    for number in range(3):
        room.line.send(GuardRequest(number, Event.TEST))
    for number in range(3):
        room.tick()
        assert [reply.number for reply in room.line.replies()] == [number]


def ticks_until_end(room: Room, most: int) -> int:
    """Return the number of ticks of a millisecond after which the run is asked to end; `most` if it is not."""
    for k in range(most):
        Clock.now += 1_000_000
        room.tick()
        if room.hearing.is_asked_to_end:
            return k
    return most


def test_a_silent_parent_means_the_end_and_a_parent_that_gives_signs_of_life_does_not(room: Room):
    for _ in range(10):
        room.line.beat()
        assert ticks_until_end(room, 1000) == 1000
    late = ticks_until_end(room, 10_000)
    assert late <= 1000 * PARENT_SILENT_S + ASK_PARENT_EVERY
    assert room.guard.envelope.stop is StopReason.STOP_PRESSED
    assert room.notes == [PARENT_SILENT]


def test_a_word_or_half_a_word_by_the_pipe_means_the_end(room: Room):
    os.write(room.ours.fileno(), struct.pack("!i", 1000))
    assert ticks_until_end(room, 1000) <= ASK_PARENT_EVERY
    assert room.guard.envelope.stop is StopReason.STOP_PRESSED


def test_a_parent_that_reads_no_reply_delays_no_tick_and_gets_the_oldest(room: Room):
    lease(room)
    for number in range(2000):
        room.line.send(FeltLevel(0.5, 10.0, number))
        room.tick()
    assert [reply.number for reply in room.line.replies()][:3] == [0, 1, 2]
    assert room.guard.envelope.stop is None


def test_without_its_parent_the_guard_lets_the_arm_down_and_ends_the_run(room: Room):
    room.ours.close()
    for _ in range(ASK_PARENT_EVERY):
        room.tick()
    assert room.hearing.is_asked_to_end
    assert room.guard.envelope.stop is StopReason.STOP_PRESSED
    for _ in range(ASK_PARENT_EVERY):
        room.tick()  # and the closed line is not polled


def test_control_gets_each_event_once_and_the_next_one_only_after_its_answer(room: Room):
    lease(room)
    assert room.says(GuardRequest(1, Event.TEST)) == ""
    room.answers = False
    room.hearing.tell(room.state)
    assert (int(room.state["asked"]), ASKABLE[int(room.state["event"])]) == (1, Event.TEST)
    room.hearing.tell(room.state)
    assert int(room.state["asked"]) == 1
    room.hearing.delivered()
    room.hearing.tell(room.state)
    assert (int(room.state["asked"]), ASKABLE[int(room.state["event"])]) == (2, Event.PASSED)
    room.hearing.delivered()
    room.hearing.tell(room.state)
    assert int(room.state["asked"]) == 2


def test_no_request_from_before_a_stop_reaches_control_after_it(room: Room):
    lease(room)
    assert room.says(GuardRequest(1, Event.TEST)) == ""
    room.guard.press_stop()
    room.hearing.latched()
    for _ in range(DOWN):
        room.tick()
    lease(room)
    assert room.says(GuardRequest(2, Event.RESET)) == ""
    for _ in range(5):
        room.tick()
    assert int(room.state["asked"]) == 0


def test_a_reset_waits_until_the_arm_is_down_and_control_answers_and_leaves_the_latch(room: Room):
    lease(room)
    room.mode = Mode.SAFE
    room.says(DescentCommand(1))
    assert "still coming down" in (room.says(GuardRequest(2, Event.RESET)) or "")
    for _ in range(DOWN):
        room.tick()
    room.answers = False
    assert "does not answer" in (room.says(GuardRequest(3, Event.RESET)) or "")
    room.answers = True
    assert room.says(GuardRequest(4, Event.RESET)) == ""
    assert room.guard.envelope.stop is None
    assert room.hearing.acts & RESET
    room.hearing.tell(room.state)  # this tick still carried a safe state
    assert int(room.state["asked"]) == 0
    room.state["safe_state"] = SafeState.NONE
    room.hearing.tell(room.state)
    assert ASKABLE[int(room.state["event"])] is Event.RESET


def test_a_reset_without_a_lease_is_refused(room: Room):
    room.mode = Mode.SAFE
    room.says(DescentCommand(1))
    for _ in range(DOWN):
        room.tick()
    assert "No operator steers" in (room.says(GuardRequest(2, Event.RESET)) or "")
    assert room.guard.envelope.stop is not None


def test_a_gravity_level_from_a_steering_page_is_answered_and_reached_by_the_requested_ramp(room: Room):
    assert "No operator steers" in (room.says(FeltLevel(0.5, 10.0, 1)) or "")
    lease(room)
    assert room.says(FeltLevel(0.5, 10.0, 2)) == ""
    assert room.hearing.acts & TOLD_LEVEL
    for _ in range(1000):
        room.tick()
    person = room.guard.envelope.person
    assert person is not None
    assert person.gravity_level == pytest.approx(0.05, abs=1e-4)


def test_an_arm_that_is_carried_when_the_lease_ends_is_given_back(room: Room):
    lease(room)
    room.mode = Mode.FLOATING
    Clock.now = 1_300_000_000
    room.tick()
    assert any("No operator steers" in note for note in room.notes)
    room.hearing.tell(room.state)
    assert ASKABLE[int(room.state["event"])] is Event.GIVE_BACK


def test_the_last_message_lets_the_arm_down_and_ends_the_run(room: Room):
    room.says(ENDS)
    assert room.hearing.is_asked_to_end
    assert room.guard.envelope.stop is StopReason.STOP_PRESSED


def limits_of_a_person() -> PersonLimits:
    nothing, wide = np.zeros((1, 3)), np.full(1, 20.0)
    table = PlausibleTable((LimbTable((0,), 1, nothing, nothing),), wide, wide, wide)
    return PersonLimits(table, wide, np.full(1, -2.0), np.full(1, 2.0))


def test_a_closed_line_refuses_messages_and_its_memory_is_gone():
    line = GuardLine()
    names = line.names
    line.close()
    with pytest.raises(OSError, match="The run is over") as refusal:
        line.send(ENDS)
    assert refusal.value.errno == errno.EPIPE
    for opened in (
        lambda: MessageRing(names.messages), lambda: MessageRing(names.replies), lambda: Mailbox(PULSE, names.pulse)
    ):  # fmt: skip
        with pytest.raises(FileNotFoundError):
            opened()


def test_a_sender_whose_guard_takes_nothing_gets_an_error_and_does_not_wait(room: Room):
    def send_many() -> None:
        for _ in range(10_000):
            room.line.send(ENDS)

    with pytest.raises(OSError, match="does not take messages") as refusal:
        send_many()
    assert refusal.value.errno == errno.ENOBUFS


@pytest.mark.parametrize("is_update", [False, True])
def test_a_new_person_is_in_force_at_the_level_that_is_felt_and_led_only_if_the_machine_leads(
    room: Room, is_update: bool
):
    before, limits = room.guard.envelope.person, limits_of_a_person()
    assert before is not None
    before.gravity_level = 0.4
    assert room.says(PersonUpdate(limits) if is_update else limits) is None
    person = room.guard.envelope.person
    assert person is not None
    assert person is not before
    assert person.limits.q_upper == limits.q_upper != before.limits.q_upper
    assert (person.gravity_level, person.is_driven) == (0.4, is_update)
    assert room.hearing.persons == 1
    assert room.hearing.acts == TOLD_PERSON
    assert room.notes == [PERSON_KNOWN]
    room.tick()
    room.hearing.tell(room.state)
    assert int(room.state["persons"]) == 1


def test_the_first_person_in_an_empty_machine_floats_weightless(room: Room):
    room.guard.envelope.person = None
    room.says(limits_of_a_person())
    person = room.guard.envelope.person
    assert person is not None
    assert person.gravity_level == 0.0


def test_a_level_of_no_page_is_taken_until_the_first_stop_of_the_run_and_never_after_it(room: Room):
    assert room.says(FeltLevel(0.5, 10.0)) is None
    assert room.hearing.acts == TOLD_LEVEL
    room.guard.press_stop()
    room.hearing.latched()
    for _ in range(DOWN):
        room.tick()
    assert room.guard.reset()
    assert room.says(FeltLevel(0.2, 10.0)) is None
    assert room.hearing.acts == 0
    assert room.notes == [level_note(0.5, ""), level_note(0.2, STOPPED_BEFORE)]


def test_a_level_above_one_needs_consent_and_after_a_stop_the_stop_is_the_reason(room: Room):
    lease(room)
    assert room.says(FeltLevel(1.4, 10.0, 1)) == NOT_AGREED
    assert room.says(FeltLevel(1.0, 10.0, 2)) == ""
    assert room.says(Consent(3)) == ""
    assert room.hearing.acts == CONSENTED
    assert room.says(FeltLevel(1.4, 10.0, 4)) == ""
    room.guard.press_stop()
    for number, level in enumerate((0.5, 1.4), start=5):
        assert room.says(FeltLevel(level, 10.0, number)) == STOPPED_BEFORE
    assert room.says(Consent(7)) == NOT_TAKEN
    assert room.hearing.acts == 0
    assert room.says(Consent()) is None
    assert [note for note in room.notes if note in (AGREED, NOT_TAKEN)] == [AGREED, NOT_TAKEN, NOT_TAKEN]


def test_a_series_of_levels_of_a_page_is_noted_by_its_first_and_its_last_one(room: Room):
    lease(room)
    for number in range(5):
        assert room.says(FeltLevel(0.1 * number, 1.0, number)) == ""
    for _ in range(round(QUIET_S / PERIOD_S) - 1):
        room.tick()
    assert room.notes == [level_note(0.0, "")]
    for _ in range(5):
        room.tick()
    assert room.notes == [level_note(0.0, ""), level_note(0.4, "")]
    for _ in range(2000):
        room.tick()
    assert len(room.notes) == 2
    assert room.says(FeltLevel(0.2, 1.0, 9)) == ""
    assert room.notes[2:] == [level_note(0.2, "")]


def test_levels_that_no_page_asks_for_are_all_noted_at_once(room: Room):
    for level in (0.5, 0.2):
        room.says(FeltLevel(level, 10.0))
    assert room.notes == [level_note(0.5, ""), level_note(0.2, "")]


def test_a_note_of_a_level_says_why_it_was_refused():
    assert level_note(0.25, "too late.") == "A request for support 75 % (felt weight 25 %) was refused: too late."
    assert level_note(0.25, "") == "From here on, by a ramp: support 75 % (felt weight 25 %)."


def test_each_request_is_noted_with_its_reply(room: Room):
    lease(room)
    room.says(GuardRequest(1, Event.TEST))
    why = room.says(GuardRequest(2, Event.MOVE))
    assert room.notes == [f"{Event.TEST.value}: done.", f"{Event.MOVE.value}: {why}"]


def test_a_reset_by_the_process_itself_is_noted_if_the_guard_was_left(room: Room):
    room.tick()
    room.guard.press_stop()
    room.tick()
    assert not room.hearing.reset(0.0, "left")
    assert (room.notes, room.hearing.acts) == ([], 0)
    for _ in range(DOWN):
        room.tick()
    assert room.hearing.reset(0.0, "left")
    assert (room.notes, room.hearing.acts) == (["left"], RESET)


def test_a_reset_of_a_machine_whose_motors_were_off_asks_control_for_nothing(room: Room):
    lease(room)
    room.guard.press_stop()
    for _ in range(DOWN):
        room.tick()
    room.mode = Mode.OFF
    assert room.says(GuardRequest(1, Event.RESET)) == ""
    assert room.hearing.acts == RESET
    room.state["safe_state"] = SafeState.NONE
    room.hearing.tell(room.state)
    assert int(room.state["asked"]) == 0


def test_a_window_that_has_to_stop_without_its_operator_lets_the_arm_down(room: Room):
    room.mode = Mode.FLOATING
    room.says(LeaseCommand(1_000_000, 10**9, "stop"))
    Clock.now = 2_000_000
    room.tick()
    assert room.guard.envelope.stop is StopReason.STOP_PRESSED
    assert room.hearing.acts == STOP_PRESSED


def test_nobody_looks_after_a_lease_before_control_has_reported_a_mode(room: Room):
    lease(room)
    Clock.now, room.mode = FAR, None
    room.tick()
    assert room.notes == []


def test_without_shared_memory_only_the_end_of_the_parent_is_heard():
    ours, theirs = Pipe()
    with contextlib.closing(theirs), contextlib.closing(GuardInbox(None, theirs)) as inbox:
        inbox.reply(ENDS)
        assert inbox.take() is None
        assert inbox.why_gone() == ""
        ours.close()
        assert [inbox.why_gone() for _ in range(2)] == [PARENT_GONE, ""]


def test_a_parent_is_looked_for_a_few_times_in_a_second_and_not_in_each_tick(room: Room):
    room.ours.close()
    ticks = ticks_until_end(room, 1000)
    assert ticks == ASK_PARENT_EVERY - 2
