"""Guard process whose millisecond runs in C: this file starts the loop, passes orders on, and tells what happened.

The loop has a thread of its own, without the interpreter's lock. It never waits for the supervisor here: a supervisor
that hangs costs the run (the loop lets the arm down), not a tick.
"""

import ctypes
import math
import threading
import time
from collections import deque
from concurrent.futures import ThreadPoolExecutor
from multiprocessing.connection import Connection
from typing import Any

import numpy as np

from exograv.loop.control_step import CLOSURE_SLOPE_MAX
from exograv.loop.drift_finding import DriftFinding
from exograv.recording.encoding import tick_dtype
from exograv.recording.guard_state import EVERY_S
from exograv.rig import may_be_worn
from exograv.rig.drives.opening import DrivenRig
from exograv.runtime.clock.host import loop_cpus
from exograv.runtime.clock.real_time_loop import LEAD_NS, REST_AT_LEAST_EVERY
from exograv.runtime.clock.realtime import GUARD_PRIORITY, Rights, realtime
from exograv.runtime.clock.timing import LoopOutcome, Timing
from exograv.runtime.control_loop.exchange import Consent, FeltLevel, PersonUpdate, answer_dtype, state_dtype
from exograv.runtime.control_loop.guard_commands import (
    AGREED,
    NOT_AGREED,
    NOT_TAKEN,
    PERSON_KNOWN,
    STOPPED_BEFORE,
    GuardInbox,
    level_note,
)
from exograv.runtime.processes.shared_memory import Mailbox
from exograv.runtime.recorder.recorder_process import PHASE, event
from exograv.safety.envelope import NUMBERS, REASONS
from exograv.safety.guard import COMMAND_LIFE_S, GRAVITY_LEVEL_S, SafeState
from exograv.safety.limits import PersonLimits
from exograv.safety.person import PLACES, GuardedPerson
from exograv.safety.stops import StopReason

from .guard_job import (
    ASKED_AGAIN_EVERY,
    GIVEN_UP_AFTER,
    LOOK_S,
    TIME_IS_OVER,
    GuardedRig,
    GuardJob,
    GuardReport,
    StopLatch,
    answer_by_ns,
    reported,
)
from .guard_states import GuardStates
from .native import library
from .native.record import (
    AnswerPlaces,
    GuardPlaces,
    Happening,
    HappeningPlace,
    LiveLoop,
    MailboxPlace,
    Order,
    OrderPlace,
    Outcome,
    StatePlaces,
    TickPlaces,
)
from .native_buses import NativeBus, native_bus

TURN_S = 0.005
"""Time between two looks of the supervisor at the loop and at the messages of the parent [s]."""

ALONE_AFTER_S = 2.0
"""Silence of the supervisor after which the loop lets the arm down [s].

It is far more than a busy computer takes from an ordinary process, and the supervisor is needed for Stop only.
"""

ALONE = "The supervisor of the guard was silent for too long: the arm is let down."

IN_C = "loop in C"
"""Entry among the granted rights, in the report and in the recording."""

OUTCOMES = {
    Outcome.COMPLETE: LoopOutcome.COMPLETE,
    Outcome.ENDED_EARLY: LoopOutcome.ENDED_EARLY,
    Outcome.NO_REST: LoopOutcome.NO_REST,
}


def native_guard(job: GuardJob, parent: Connection, made: GuardedRig) -> "NativeGuard | None":
    """Return the guard with its loop in C, or None where that loop cannot run this machine yet.

    It needs Linux and the compiled guard, a bus of `native_buses`, a clock that runs by itself, and no page that
    steers.
    """
    loop, bus = library.LIBRARY, native_bus(made.rig)
    if loop is None or bus is None or job.is_steered or made.guard.envelope.record.library is None:
        return None
    return NativeGuard(job, parent, made, bus, loop)


class NativeGuard:
    """Loop in C with its supervisor."""

    def __init__(self, job: GuardJob, parent: Connection, made: GuardedRig, bus: NativeBus, loop: ctypes.CDLL):
        """Prepare all memory that the loop uses; nothing runs yet."""
        assert isinstance(made.rig, DrivenRig)
        self.rig, self._job, self._guard, self._library, self._bus = made.rig, job, made.guard, loop, bus
        self._announce, channels = made.announce, job.channels
        self._inbox = GuardInbox(channels.parent, parent)
        joints = channels.joints
        self._states = Mailbox(state_dtype(joints), channels.states)
        self._answers = Mailbox(answer_dtype(joints), channels.answers)
        self._ticks, self._events = channels.inlet.ticks(), channels.inlet.events()
        self._guard_states = GuardStates(channels.inlet, made.guard.envelope.record)
        self.drives: Any = bus.record()
        self._timing = np.full((3, job.periods_with_descent(made.rig)), -1, dtype=np.int64)
        self._rows = np.zeros(1, state_dtype(joints)), np.zeros(1, answer_dtype(joints)), _first_row(joints)
        self._person_places = PLACES.astype(np.int64)
        self.loop = LiveLoop()
        self._fill(made.gain)
        self._waiting: deque[OrderPlace] = deque()
        self._people: list[GuardedPerson] = []  # the loop uses their tables
        self._has_begun, self._drift_known = threading.Event(), 0
        self._latches: list[StopLatch] = []
        self._modes: list[tuple[str, float]] = []
        self.failure = ""
        """Error of the supervisor that has ended the run; empty if there was none."""

    def run(self) -> tuple[Timing, Rights]:
        """Switch the motors on, run the loop to its end, and meanwhile supervise it.

        Raises:
            RigError: A drive stays off.
        """
        with ThreadPoolExecutor(1, "loop") as threads:
            flight = threads.submit(self._fly)
            # Meanwhile the drives are switched on in Python. This thread must not hold the interpreter's lock then.
            self._has_begun.wait()
            try:
                while not flight.done():
                    self.supervise()
                    time.sleep(TURN_S)
            except Exception as error:  # noqa: BLE001 - of any error the arm comes down softly
                self.failure = reported(error)
                self._note(self.loop.now, self.failure)
            finally:
                # Whatever has happened here, the arm comes down softly before this process ends.
                self._library.loop_end(self.loop)
            rights = flight.result()
        self.hear()
        return self._measured(), rights

    def supervise(self) -> None:
        """Give a sign of life, pass on waiting orders, record what happened, and take the messages of the parent."""
        self._library.loop_beat(self.loop)
        while self._waiting and self._library.loop_order(self.loop, self._waiting[0]):
            self._waiting.popleft()
        self.hear()
        self._look_for_drift()
        if why := self._inbox.why_gone():
            self._note(self.loop.now, why)
            self._library.loop_end(self.loop)
        while (word := self._inbox.take()) is not None:
            self.order(word)

    def hear(self) -> None:
        """Record the events of the loop since the last call."""
        happening = HappeningPlace()
        while self._library.loop_hear(self.loop, happening):
            self._tell(Happening(happening.kind), happening)

    def order(self, word: object) -> None:
        """Pass a message of the parent on to the loop: person, felt level, or the end."""
        if isinstance(word, PersonLimits | PersonUpdate):
            self._wear(word)
        elif isinstance(word, FeltLevel):
            self._waiting.append(OrderPlace(Order.FEEL, (word.gravity_level, word.ramp_s)))
        elif isinstance(word, Consent):
            self._waiting.append(OrderPlace(Order.CONSENT))
        else:
            self._library.loop_end(self.loop)

    def _look_for_drift(self) -> None:
        """Record a new finding of control's drift monitor, and order a descent if it has to be."""
        answer = self._answers.read()
        before, self._drift_known = self._drift_known, 0 if answer is None else int(answer[1]["drift"])
        if self._drift_known <= before or answer is None:
            return
        finding = DriftFinding.of_answer(answer[1])
        if finding is None:
            return
        self._events.put(event(self.loop.now, "warning", finding.text(self.rig.joints)))
        if finding.stops:
            self._waiting.append(OrderPlace(Order.TRIP, (float(NUMBERS[StopReason.DRIFTED]), 0.0)))

    def report(self, timing: Timing, rights: Rights) -> GuardReport:
        """Return the report at the end of the loop."""
        loop, latches, modes = self.loop, tuple(self._latches), tuple(self._modes)
        return GuardReport(timing, rights, latches, loop.unanswered, self.rig.t, loop.started_ns, modes, self.failure)

    def close(self) -> None:
        """Release the shared memory."""
        for memory in (self._states, self._answers, self._ticks, self._events, self._guard_states, self._inbox):
            memory.close()

    def hand_over(self) -> None:
        """Give the open machine to the loop."""
        record: Any = self._bus.handed_over(self.rig)
        for hook in ("now_hook", "sleep_hook", "send_hook", "receive_hook"):
            setattr(record, hook, getattr(self.drives, hook))
        ctypes.memmove(ctypes.byref(self.drives), ctypes.byref(record), ctypes.sizeof(self._bus.record))

    def _fly(self) -> Rights:
        try:
            with realtime(loop_cpus().guard, GUARD_PRIORITY) as rights:
                rights.granted.append(IN_C)
                self.rig.enable()
                self.hand_over()
                self._library.loop_beat(self.loop)
                self._has_begun.set()
                self._library.loop_run(self.loop)
                self._bus.take_back(self.rig, self.drives)
                return rights
        finally:
            self._has_begun.set()

    def _wear(self, word: PersonLimits | PersonUpdate) -> None:
        is_driven = isinstance(word, PersonUpdate)
        person = GuardedPerson(word.person if isinstance(word, PersonUpdate) else word)
        if is_driven:
            person.drive(True)
        self._people.append(person)
        record, table = person.memory()
        self._waiting.append(OrderPlace(Order.WEAR, (0.0, 0.0), record, table))

    def _tell(self, kind: Happening, what: HappeningPlace) -> None:
        at_s = 1e-9 * (what.at_ns - self.loop.started_ns)
        if kind is Happening.MODE:
            name = self._job.mode_names[int(what.value)]
            self._modes.append((name, at_s))
            self._events.put(event(what.now, PHASE, name))
            self._announce(name)
            if text := self._job.notes.get(name):
                self._note(what.now, text)
        elif kind is Happening.STOP:
            reason = REASONS[int(what.value)]
            if self.loop.is_time_over and reason is StopReason.STOP_PRESSED:
                self._note(what.now, TIME_IS_OVER)
                return
            self._latches.append(StopLatch(reason.value, what.period, at_s))
            self._events.put(event(what.now, "stop", reason.value))
        elif kind is Happening.WORN:
            self._note(what.now, PERSON_KNOWN)
        elif kind is Happening.ALONE:
            self._note(what.now, ALONE)
        elif kind is Happening.AGREED:
            self._note(what.now, AGREED if what.value else NOT_TAKEN)
        else:
            reason = NOT_AGREED if what.value > 1.0 else STOPPED_BEFORE
            self._note(what.now, level_note(what.value, reason if kind is Happening.REFUSED else ""))

    def _note(self, now: float, text: str) -> None:
        self._events.put(event(now, "note", text))

    def _measured(self) -> Timing:
        loop, (period_of, lateness, compute) = self.loop, self._timing[:, : self.loop.ran]
        return Timing(period_of, lateness, compute, loop.passed, self._job.period_ns, OUTCOMES[Outcome(loop.outcome)])

    def _fill(self, gain: np.ndarray) -> None:
        loop, job, record = self.loop, self._job, self._guard.envelope.record
        loop.drives, (loop.guard, loop.table) = ctypes.addressof(self.drives), record.memory()
        for name in ("read", "write"):
            function = getattr(self._library, f"{self._bus.prefix}_{name}")
            setattr(loop, f"{name}_drives", ctypes.cast(function, ctypes.c_void_p).value)
        for name in ("see", "decide", "trip", "begin_torque"):
            function = getattr(record._library, f"guard_{name}")
            setattr(loop, f"guard_{name}", ctypes.cast(function, ctypes.c_void_p).value)
        loop.states, loop.answers = MailboxPlace(*self._states.places()), MailboxPlace(*self._answers.places())
        loop.ticks = MailboxPlace(*self._ticks.places())
        state, answer, row = self._rows
        loop.state_at, loop.answer_at = _offsets(StatePlaces, state.dtype), _offsets(AnswerPlaces, answer.dtype)
        loop.tick_at = _offsets(TickPlaces, row.dtype)
        loop.state, loop.answer, loop.row = (rows.ctypes.data for rows in self._rows)
        loop.person_places, loop.person_size = self._person_places.ctypes.data, len(self._person_places)
        self._fill_guard_states()
        loop.joints, loop.modes = job.channels.joints, len(job.mode_names)
        loop.flies, loop.periods = job.periods, self._timing.shape[1]
        loop.period_ns, loop.period_s, loop.lead_ns = job.period_ns, self.rig.period_s, LEAD_NS
        loop.answer_by_ns, loop.poll_ns = answer_by_ns(job.period_ns, is_native=True), round(1e9 * LOOK_S)
        loop.given_up_after, loop.asked_again_every = GIVEN_UP_AFTER, ASKED_AGAIN_EVERY
        loop.rest_at_least_every, loop.alone_after_ns = REST_AT_LEAST_EVERY, round(1e9 * ALONE_AFTER_S)
        # A latch of a real machine ends the run: the operator inspects the machine and repeats its self-test first.
        loop.ends_stopped, loop.mode, loop.safe_state = may_be_worn(self.rig), -1, SafeState.NONE
        loop.slope_max, loop.life_s, loop.level_s = CLOSURE_SLOPE_MAX, COMMAND_LIFE_S, GRAVITY_LEVEL_S
        loop.gain[: len(gain)] = gain.tolist()
        loop.period_of, loop.lateness_ns, loop.compute_ns = (row.ctypes.data for row in self._timing)

    def _fill_guard_states(self) -> None:
        loop, states = self.loop, self._guard_states
        self._state_places = states.places.astype(np.int64)
        loop.guards, loop.guard_at = MailboxPlace(*states.ring_places()), _offsets(GuardPlaces, states.row.dtype)
        loop.guard_row, loop.guard_places = states.row.ctypes.data, self._state_places.ctypes.data
        loop.guard_size, loop.keeps_every_s, loop.keeps_next = len(self._state_places), EVERY_S, -math.inf


def _first_row(joints: int) -> np.ndarray:
    row = np.zeros(1, tick_dtype(joints))
    row["cdr_header"] = (0, 1, 0, 0)
    for name in ("q_reference", "v_reference", "a_reference"):
        row[name] = np.nan
    return row


def _offsets(kind: type[ctypes.Structure], dtype: np.dtype) -> ctypes.Structure:
    fields = dtype.fields or {}
    return kind(**{name: place[1] for name, place in fields.items() if name != "cdr_header"})
