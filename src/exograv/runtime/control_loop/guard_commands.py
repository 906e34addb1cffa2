"""Messages from the parent to the guard's process during the loop, and their execution."""

import threading
import time
from collections.abc import Callable
from multiprocessing.connection import Connection

import numpy as np

from exograv.runtime.processes.shared_memory import Mailbox
from exograv.safety.guard import Guard, SafeState
from exograv.safety.limits import PersonLimits
from exograv.safety.modes import Event, Mode
from exograv.safety.person import GuardedPerson
from exograv.sentence import say, support_text

from .exchange import EVENT_SHIFT, RESET, STOP_PRESSED, TOLD_LEVEL, TOLD_PERSON, FeltLevel, PersonUpdate
from .steering import ASKABLE, SENTENCES, CommandDecisions, DescentCommand, GuardReply, GuardRequest, LeaseCommand

ASK_PARENT_EVERY = 200
"""Ticks between two looks at the connection without an announcement, to check that the parent lives."""

BELL = np.dtype("<u8")
"""Counter of the messages that were sent."""

ENDS = "stop"
"""Message that lets the arm down and ends the run."""


PERSON_KNOWN = "The guard knows the person as identified."
"""Note of a guard that has taken the limits of a person."""

STOPPED_BEFORE = "the run was stopped before, or the arm is being moved."
"""Reason why a felt level is refused."""


def level_note(gravity_level: float, why: str) -> str:
    """Note of a request for a felt level; `why` is the reason of a refusal, or empty."""
    support = support_text(gravity_level)
    return f"A request for {support} was refused: {why}" if why else f"From here on, by a ramp: {support}."


class GuardLine:
    """Parent's end of the connection; the guard takes one message per tick, from the next tick on. Thread-safe."""

    def __init__(self, connection: Connection, bell: Mailbox):
        self._connection, self._bell, self._lock, self._sent = connection, bell, threading.Lock(), 0

    def send(self, word: object) -> None:
        """Send a message and return before the guard takes it.

        Raises:
            OSError: The guard's process has ended.
        """
        with self._lock:
            self._connection.send(word)
            self._sent += 1
            self._bell.write(np.uint64(self._sent))


class GuardCommands:
    """Guard's end of the connection: executes the messages."""

    def __init__(self, guard: Guard, parent: Connection, bell: Mailbox | None, note: Callable[[float, str], object]):
        """Start without a message.

        Args:
            guard: Guard that executes the messages.
            parent: Connection to the parent.
            bell: Mailbox with the parent's counter of messages; None if there is none.
            note: Function that records a line of this time [s].
        """
        self._guard, self._parent, self._bell, self._note = guard, parent, bell, note
        self._steering, self._heard, self._has_latched, self._is_delivered = CommandDecisions(), 0, False, True
        self.acts = 0
        """Acts since the last recorded tick, as `acts` there."""
        self.persons = 0
        """Number of messages about the person in the machine."""
        self.is_asked_to_end = False

    def listen(self, period: int, now: float, mode: Mode | None, *, is_answered: bool) -> None:
        """Take one message if there is one; to be called at the end of each tick.

        Args:
            period: Number of the tick.
            now: Time on the rig's clock [s].
            mode: Last mode that control reported.
            is_answered: True if control answers.
        """
        self._look_after_lease(mode, now)
        is_rung = self._bell is not None and self._bell.count != self._heard
        if self._parent.closed or not (is_rung or period % ASK_PARENT_EVERY == 0) or not self._parent.poll():
            return
        try:
            word = self._parent.recv()
        except EOFError:  # the parent, which alone could end the run, is gone
            self._parent.close()
            word = ENDS
        self._heard += 1
        self.hear(word, now, mode, is_answered=is_answered)

    def hear(self, word: object, now: float, mode: Mode | None = None, *, is_answered: bool = True) -> None:
        """Execute a message: person in the machine, felt level, operator's request, or end of the run."""
        if isinstance(word, PersonLimits | PersonUpdate):
            self._wear(word, now)
        elif isinstance(word, FeltLevel):
            self._feel(word, now)
        elif isinstance(word, LeaseCommand):
            self._steering.lease(word, time.monotonic_ns())
        elif isinstance(word, GuardRequest):
            why = self._ask(word.event, mode or Mode.OFF, is_answered=is_answered)
            self._answer(word.number, why, now, word.event.value)
        elif isinstance(word, DescentCommand):
            self._press_stop()
            self._answer(word.number, "", now, "operator: stop")
        else:
            self.is_asked_to_end = True
            self._press_stop()

    def latched(self) -> None:
        """Take note that the guard has stopped."""
        self._has_latched = True
        self._steering.stopped()

    def tell(self, state: np.ndarray) -> None:
        """Fill in the operator's requests for control, in a row of `state_dtype` that was filled in the last tick."""
        state["persons"] = self.persons
        # While control knows of a stop it accepts no request, and no request is kept for later.
        is_free = self._is_delivered and state["safe_state"] < SafeState.DESCENT
        if is_free and (event := self._steering.next()) is not None:
            self._is_delivered = False
            state["asked"], state["event"] = state["asked"] + 1, ASKABLE.index(event)
            self.acts |= (ASKABLE.index(event) + 1) << EVENT_SHIFT

    def delivered(self) -> None:
        """Take note that control has answered the last request."""
        self._is_delivered = True

    def reset(self, now: float, text: str) -> bool:
        """Leave the latch if the guard allows it; return True if it did."""
        is_left = self._guard.reset()
        if is_left:
            self.acts |= RESET
            self._note(now, text)
        return is_left

    def _press_stop(self) -> None:
        self.acts |= STOP_PRESSED
        self._guard.press_stop()

    def _look_after_lease(self, mode: Mode | None, now: float) -> None:
        if mode is None:
            return
        why = self._steering.watch(mode, time.monotonic_ns())
        if why:
            self._note(now, why)
            if self._steering.is_to_stop:
                self._press_stop()

    def _ask(self, event: Event, mode: Mode, *, is_answered: bool) -> str:
        is_latched = self._guard.envelope.stop is not None
        if event is Event.RESET and is_latched:
            if why := self._steering.why_nobody(time.monotonic_ns()):
                return why
            # An arm is never handed to a control process that is not there: it has to answer first.
            if not (is_answered and self._guard.reset()):
                return say(SENTENCES, "guard.still_down")
            self.acts |= RESET
            is_latched = False
            if mode is not Mode.SAFE:
                return ""  # the motors were off, so control has no latch to leave
        return self._steering.ask(event, mode, is_latched=is_latched, now_ns=time.monotonic_ns())

    def _answer(self, number: int, why: str, now: float, what: str) -> None:
        self._note(now, f"{what}: {why or 'done.'}")
        self._parent.send(GuardReply(number, why))

    def _wear(self, word: PersonLimits | PersonUpdate, now: float) -> None:
        before, limits = self._guard.envelope.person, word.person if isinstance(word, PersonUpdate) else word
        person = GuardedPerson(limits, before.gravity_level if before else 0.0)
        if isinstance(word, PersonUpdate):
            person.drive(True)
        self._guard.envelope.person = person
        self.persons += 1
        self.acts |= TOLD_PERSON
        self._note(now, PERSON_KNOWN)

    def _feel(self, word: FeltLevel, now: float) -> None:
        """Start the ramp to a requested level; a request without a number is refused after the first stop of a run."""
        why = STOPPED_BEFORE
        if word.number is not None:
            why = self._steering.why_nobody(time.monotonic_ns())
        elif not self._has_latched:
            why = ""
        if not why and not self._guard.feel(word.gravity_level, word.ramp_s):
            why = STOPPED_BEFORE
        if not why:
            self.acts |= TOLD_LEVEL
        self._note(now, level_note(word.gravity_level, why))
        if word.number is not None:
            self._parent.send(GuardReply(word.number, why))
