"""Checks of requests from a person who is not at the machine, made in the guard's process.

A page that steers renews a lease. Without a lease no action begins, and an arm that is carried is given back.
"""

from collections import deque
from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType

from exograv.options import Loss
from exograv.safety.modes import TRANSITIONS, WORN, Event, Mode
from exograv.sentence import say

LEASE_MAX_NS = 1_200_000_000
"""Longest lease (docs/explanation/safety.md, F31) [ns]."""

READY_NS = 30_000_000_000
"""Time after the machine was made ready in which the arm may be taken [ns]."""

WINDOW_MAX_NS = 22_000_000_000
"""Longest time after the loss of the operator in which a trial's open window may be finished [ns]."""

ASKABLE = (Event.TEST, Event.PASSED, Event.TAKE_ARM, Event.GIVE_BACK, Event.SWITCH_OFF, Event.RESET)
"""Events that are sent to control; a recorded tick names them by their index here."""

SENTENCES: Mapping[str, str] = MappingProxyType(
    {
        "guard.nobody": "No operator steers: the operator's page was silent for too long.",
        "guard.not_askable": "This cannot be requested from a page.",
        "guard.stopped": "The machine has been stopped. Reset it first.",
        "guard.still_down": "The arm is still coming down, or the machine does not answer. Wait, then reset again.",
        "desk.nobody_any_more": "No operator steers any more: the operator's page is silent.",
        "desk.not_possible": "Not possible now. {mode}",
        "desk.no_step_one": "Step one was not done in the last 30 s. Make the machine ready again.",
    }
)
"""Reasons of refusal of the guard's process, in English."""


@dataclass(frozen=True)
class GuardRequest:
    """Message to the guard: request of an event."""

    number: int
    """Number for the reply."""
    event: Event


@dataclass(frozen=True)
class DescentCommand:
    """Message to the guard: let the arm down; the run goes on."""

    number: int


@dataclass(frozen=True)
class LeaseCommand:
    """Message to the guard: a page steers, until the given time."""

    until_ns: int
    """End of the lease on CLOCK_MONOTONIC [ns]."""
    window_until_ns: int | None = None
    """End of the open window of a trial [ns]; None without one."""
    on_loss: Loss = "finish"


@dataclass(frozen=True)
class GuardReply:
    """Message from the guard: reply to the message with this number."""

    number: int
    why: str = ""
    """Reason of refusal; empty if the request was executed."""


class CommandDecisions:
    """Decisions about requests, and the queue of events for control."""

    def __init__(self):
        self._waiting: deque[Event] = deque()
        self._ready_until_ns = self._lease_until_ns = -1
        self._window_until_ns, self._on_loss = -1, "finish"
        self._is_lost = self._gives_back = False

    def lease(self, word: LeaseCommand, now_ns: int) -> None:
        """Renew the lease of the steering page."""
        self._lease_until_ns = min(word.until_ns, now_ns + LEASE_MAX_NS)
        self._window_until_ns = -1 if word.window_until_ns is None else word.window_until_ns
        self._on_loss = word.on_loss

    def why_nobody(self, now_ns: int) -> str:
        """Return the reason why no page may request anything; empty while a page steers."""
        return say(SENTENCES, "guard.nobody") if now_ns > self._lease_until_ns else ""

    def ask(self, event: Event, mode: Mode, *, is_latched: bool, now_ns: int) -> str:
        """Pass an event to control, or return the reason for its refusal; empty if it was passed on.

        Args:
            event: Requested event.
            mode: Last mode that control reported.
            is_latched: True if the guard has stopped and was not reset. A reset comes here after the guard's own.
            now_ns: Time on CLOCK_MONOTONIC [ns].
        """
        if why := self.why_nobody(now_ns):
            return why
        if event not in ASKABLE or event is Event.PASSED:
            return say(SENTENCES, "guard.not_askable")
        if is_latched:
            return say(SENTENCES, "guard.stopped")
        if event is Event.TEST and mode is Mode.EXO_ONLY:
            self._ready_until_ns = now_ns + READY_NS  # step one again
            return ""
        if (mode, event) not in TRANSITIONS or self._waiting:
            return say(SENTENCES, "desk.not_possible", mode=mode.sentence)
        if event is Event.TAKE_ARM and now_ns > self._ready_until_ns:
            return say(SENTENCES, "desk.no_step_one")
        self._ready_until_ns = now_ns + READY_NS if event is Event.TEST else -1
        self._waiting.append(event)
        if event is Event.TEST:
            self._waiting.append(
                Event.PASSED
            )  # done before the loop, or skipped on the twin, and the recording says so
        return ""

    def stopped(self) -> None:
        """Discard all requests from before a stop."""
        self._waiting.clear()
        self._ready_until_ns = -1

    def watch(self, mode: Mode, now_ns: int) -> str:
        """Check the lease, and return a sentence if it has just been lost; to be called in each tick."""
        if now_ns <= self._lease_until_ns:
            self._is_lost = self._gives_back = False
            return ""
        if self._lease_until_ns < 0 or (self._is_lost and mode not in WORN):
            return ""
        was_lost, self._is_lost = self._is_lost, True
        if not was_lost:
            self._ready_until_ns = -1
            self._waiting.clear()
            self._gives_back = False
        finishes = self._on_loss == "finish" and now_ns < min(
            self._window_until_ns, self._lease_until_ns + WINDOW_MAX_NS
        )
        if not (finishes or self._gives_back or self.is_to_stop) and (mode, Event.GIVE_BACK) in TRANSITIONS:
            self._gives_back = True
            self._waiting.append(Event.GIVE_BACK)
        return "" if was_lost else say(SENTENCES, "desk.nobody_any_more")

    @property
    def is_to_stop(self) -> bool:
        """True if a window was open when the lease was lost, and the setting is to stop it."""
        return self._is_lost and self._on_loss == "stop" and self._window_until_ns > self._lease_until_ns

    def next(self) -> Event | None:
        """Next event for control, given once; None if there is none."""
        return self._waiting.popleft() if self._waiting else None
