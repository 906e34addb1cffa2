"""Messages from the parent to the guard's process during the loop, and their execution.

Both directions are rings in shared memory, so that no process waits for another one. The pipe of the process carries
the start and the report only. In the loop, anything that comes by it, or its end, means that the run has to end.
"""

import errno
import threading
import time
from collections.abc import Callable, Iterator
from multiprocessing.connection import Connection
from typing import Any

import numpy as np

from exograv.runtime.processes.shared_memory import Mailbox, MessageRing
from exograv.safety.guard import CONSENT_S, Guard, SafeState
from exograv.safety.limits import PersonLimits
from exograv.safety.modes import Event, Mode
from exograv.safety.person import GuardedPerson
from exograv.sentence import say, support_text

from .exchange import (
    CONSENTED,
    EVENT_SHIFT,
    RESET,
    STOP_PRESSED,
    TOLD_LEVEL,
    TOLD_PERSON,
    Consent,
    FeltLevel,
    MessageNames,
    PersonUpdate,
)
from .steering import ASKABLE, SENTENCES, CommandDecisions, DescentCommand, GuardReply, GuardRequest, LeaseCommand

ASK_PARENT_EVERY = 200
"""Ticks between two checks that the parent lives."""

PARENT_SILENT_S = 2.0
"""Time without a sign of life of the parent, after which the guard lets the arm down and ends the run [s].

The parent gives four signs in a second. A busy computer delays an ordinary process by some tenths of a second.
"""

PULSE = np.dtype("<u8")
"""Counter of the parent's signs of life."""

ENDS = "stop"
"""Message that lets the arm down and ends the run."""


PERSON_KNOWN = "The guard knows the person as identified."
"""Note of a guard that has taken the limits of a person."""

STOPPED_BEFORE = "the run was stopped before, or the arm is being moved."
"""Reason why a felt level is refused."""

NOT_AGREED = "above Earth gravity the arm is pushed down, and the participant has to agree first."
"""Reason why a felt level above 1 is refused."""

AGREED = f"The participant agrees for {CONSENT_S:g} s that the arm is pushed down."
NOT_TAKEN = "The participant's consent was not taken: nobody is in the machine, or the run was stopped before."


PARENT_GONE = "The session of this machine has ended: the arm is let down."
PARENT_SILENT = f"The session of this machine gave no sign of life for {PARENT_SILENT_S:g} s: the arm is let down."
"""Notes of a guard whose parent is gone or silent."""


QUIET_S = 0.5
"""Time without a further request for a level after which the last one is noted [s]. A protocol requests its ramps in
small steps: their first and their last level are noted."""


def level_note(gravity_level: float, why: str) -> str:
    """Note of a request for a felt level; `why` is the reason of a refusal, or empty."""
    support = support_text(gravity_level)
    return f"A request for {support} was refused: {why}" if why else f"From here on, by a ramp: {support}."


class GuardLine:
    """Parent's end of the messages; the guard takes one message per tick, from the next tick on. Thread-safe."""

    def __init__(self) -> None:
        """Create the shared memory."""
        self._messages, self._replies, self._pulse = MessageRing(), MessageRing(), Mailbox(PULSE)
        self._lock, self._beats, self._is_closed = threading.Lock(), 0, False

    @property
    def names(self) -> MessageNames:
        """Names of the shared memory, for the guard's process."""
        return MessageNames(self._messages.name, self._replies.name, self._pulse.name)

    def send(self, message: object) -> None:
        """Send a message and return before the guard takes it.

        Raises:
            OSError: The run is over, or the guard has not taken the last messages.
        """
        with self._lock:
            if self._is_closed:
                raise OSError(errno.EPIPE, "The run is over")
            if not self._messages.put(message):
                raise OSError(errno.ENOBUFS, "The guard does not take messages any more")

    def beat(self) -> None:
        """Give a sign of life; call it several times a second."""
        with self._lock:
            self._beats += 1
            self._pulse.write(np.uint64(self._beats))

    def replies(self) -> Iterator[Any]:
        """Yield the replies that have arrived."""
        while (reply := self._replies.take()) is not None:
            yield reply

    def close(self) -> None:
        """Release the shared memory; messages are refused from now on."""
        with self._lock:
            self._is_closed = True
            for memory in (self._messages, self._replies, self._pulse):
                memory.close()


class GuardInbox:
    """Guard's end of the messages. Nothing here waits, whatever the parent does."""

    def __init__(self, names: MessageNames | None, parent: Connection):
        """Open the shared memory; without names only the end of the parent is heard."""
        self._parent, self._is_over = parent, False
        self._messages = self._replies = self._pulse = None
        if names is not None:
            self._messages, self._replies = MessageRing(names.messages), MessageRing(names.replies)
            self._pulse = Mailbox(PULSE, names.pulse)
        self._beats, self._beat_ns = 0, time.monotonic_ns()

    def take(self) -> Any:
        """Return the oldest message; None if there is none."""
        return None if self._messages is None else self._messages.take()

    def reply(self, message: object) -> None:
        """Reply to the parent; a parent that does not read loses the reply."""
        if self._replies is not None:
            self._replies.put(message)

    def why_gone(self) -> str:
        """Reason to end the run because of the parent, once; empty if the parent lives."""
        if self._is_over:
            return ""
        now, beats = time.monotonic_ns(), self._beats if self._pulse is None else self._pulse.count
        if beats != self._beats or self._pulse is None:
            self._beats, self._beat_ns = beats, now
        # Nothing comes by the pipe in the loop: it has ended, or the parent is out of order.
        why = (
            PARENT_GONE if self._parent.poll() else PARENT_SILENT if now - self._beat_ns > 1e9 * PARENT_SILENT_S else ""
        )
        self._is_over = bool(why)
        return why

    def close(self) -> None:
        """Release the shared memory."""
        for memory in (self._messages, self._replies, self._pulse):
            if memory is not None:
                memory.close()


class GuardCommands:
    """Guard's end of the connection: executes the messages."""

    def __init__(self, guard: Guard, inbox: GuardInbox, note: Callable[[float, str], object]):
        """Start without a message.

        Args:
            guard: Guard that executes the messages.
            inbox: Messages of the parent.
            note: Function that records a line of this time [s].
        """
        self._guard, self._inbox, self._note = guard, inbox, note
        self._steering, self._has_latched, self._is_delivered = CommandDecisions(), False, True
        self.acts = 0
        """Acts since the last recorded tick, as `acts` there."""
        self.persons = 0
        """Number of messages about the person in the machine."""
        self.is_asked_to_end = False
        self._felt_at, self._unsaid = -np.inf, ""

    def listen(self, period: int, now: float, mode: Mode | None, *, is_answered: bool) -> None:
        """Take one message if there is one; to be called at the end of each tick.

        Args:
            period: Number of the tick.
            now: Time on the rig's clock [s].
            mode: Last mode that control reported.
            is_answered: True if control answers.
        """
        self._look_after_lease(mode, now)
        if self._unsaid and now - self._felt_at > QUIET_S:
            self._note(now, self._unsaid)
            self._unsaid = ""
        if period % ASK_PARENT_EVERY == 0 and (why := self._inbox.why_gone()):
            self._note(now, why)
            self.hear(ENDS, now, mode, is_answered=is_answered)
        elif (word := self._inbox.take()) is not None:
            self.hear(word, now, mode, is_answered=is_answered)

    def hear(self, word: object, now: float, mode: Mode | None = None, *, is_answered: bool = True) -> None:
        """Execute a message: person in the machine, felt level, operator's request, or end of the run."""
        if isinstance(word, PersonLimits | PersonUpdate):
            self._wear(word, now)
        elif isinstance(word, FeltLevel):
            self._feel(word, now)
        elif isinstance(word, Consent):
            self._consent(word, now)
        elif isinstance(word, LeaseCommand):
            self._steering.lease(word, time.monotonic_ns())
        elif isinstance(word, GuardRequest):
            why = self._ask(word.event, mode or Mode.OFF, is_answered=is_answered)
            self._answer(word.number, why, now, word.event.value)
        elif isinstance(word, DescentCommand):
            self.press_stop()
            self._answer(word.number, "", now, "operator: stop")
        else:
            self.is_asked_to_end = True
            self.press_stop()

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

    def press_stop(self) -> None:
        """Start the descent, and note the act for the recording."""
        self.acts |= STOP_PRESSED
        self._guard.press_stop()

    def _look_after_lease(self, mode: Mode | None, now: float) -> None:
        if mode is None:
            return
        why = self._steering.watch(mode, time.monotonic_ns())
        if why:
            self._note(now, why)
            if self._steering.is_to_stop:
                self.press_stop()

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
        self._inbox.reply(GuardReply(number, why))

    def _wear(self, word: PersonLimits | PersonUpdate, now: float) -> None:
        before, limits = self._guard.envelope.person, word.person if isinstance(word, PersonUpdate) else word
        person = GuardedPerson(limits, before.gravity_level if before else 0.0)
        if isinstance(word, PersonUpdate):
            person.drive(True)
        self._guard.envelope.person = person
        self.persons += 1
        self.acts |= TOLD_PERSON
        self._note(now, PERSON_KNOWN)

    def _say_level(self, now: float, text: str, *, is_of_page: bool) -> None:
        """Note an accepted level at once, or after the last of a series of requests of a page."""
        if not is_of_page or now - self._felt_at > QUIET_S:
            self._note(now, text)
        else:
            self._unsaid = text
        self._felt_at = now

    def _consent(self, word: Consent, now: float) -> None:
        why = "" if self._guard.consent() else NOT_TAKEN
        if not why:
            self.acts |= CONSENTED
        self._note(now, why or AGREED)
        if word.number is not None:
            self._inbox.reply(GuardReply(word.number, why))

    def _feel(self, word: FeltLevel, now: float) -> None:
        """Start the ramp to a requested level; a request without a number is refused after the first stop of a run."""
        why = STOPPED_BEFORE
        if word.number is not None:
            why = self._steering.why_nobody(time.monotonic_ns())
        elif not self._has_latched:
            why = ""
        if not why and not self._guard.feel(word.gravity_level, word.ramp_s):
            needs_consent = word.gravity_level > 1.0 and self._guard.consent_s == 0.0
            why = NOT_AGREED if needs_consent and self._guard.envelope.stop is None else STOPPED_BEFORE
        text = level_note(word.gravity_level, why)
        if why:
            self._note(now, text)
        else:
            self.acts |= TOLD_LEVEL
            self._say_level(now, text, is_of_page=word.number is not None)
        if word.number is not None:
            self._inbox.reply(GuardReply(word.number, why))
