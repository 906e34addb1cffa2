"""What somebody who is not at the machine may have done: each word is checked beside the guard, in its process.

Whoever steers renews a lease. Without one nothing is begun, and an arm that is carried is given back.
"""

from collections import deque
from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType

from exograv.options import Loss
from exograv.safety.modes import TRANSITIONS, WORN, Event, Mode
from exograv.sentence import say

LEASE_MAX_NS = 1_200_000_000
"""A lease is never longer (docs/safety.md, F31) [ns]."""

READY_NS = 30_000_000_000
"""So long after the machine was made ready may the arm be taken [ns]."""

WINDOW_MAX_NS = 22_000_000_000
"""A trial's window that has begun may be finished without an operator, no later than so long after the loss [ns]."""

ASKABLE = (Event.TEST, Event.PASSED, Event.TAKE_ARM, Event.GIVE_BACK, Event.SWITCH_OFF, Event.RESET)
"""Events that control is told of; a recorded tick names them by their place here."""

SENTENCES: Mapping[str, str] = MappingProxyType(
    {
        "guard.nobody": "Nobody steers: the operator's page was silent for too long.",
        "guard.not_askable": "Nobody may ask for this from a page.",
        "guard.stopped": "The machine has been stopped. Reset it first.",
        "guard.still_down": "The arm is still coming down, or the machine does not answer. Wait, then reset again.",
        "desk.nobody_any_more": "Nobody steers any more: the operator's page is silent.",
        "desk.not_possible": "Not possible now. {mode}",
        "desk.no_step_one": "Step one was not done in the last 30 s. Make the machine ready again.",
    }
)
"""Reasons of the guard's process, in English."""


@dataclass(frozen=True)
class GuardRequest:
    """A word to the guard: let this happen, if it may."""

    number: int
    """By which it is answered."""
    event: Event


@dataclass(frozen=True)
class DescentCommand:
    """A word to the guard: let the arm down. The run goes on."""

    number: int


@dataclass(frozen=True)
class LeaseCommand:
    """A word to the guard: somebody steers, until then."""

    until_ns: int
    """On CLOCK_MONOTONIC [ns]."""
    window_until_ns: int | None = None
    """When the window of a trial ends; absent where none runs [ns]."""
    on_loss: Loss = "finish"


@dataclass(frozen=True)
class GuardReply:
    """A word from the guard: what became of one with this number."""

    number: int
    why: str = ""
    """Why not; empty where it was done."""


class CommandDecisions:
    """Decides about words; holds what is to be told to control until it is told."""

    def __init__(self):
        self._waiting: deque[Event] = deque()
        self._ready_until_ns = self._lease_until_ns = -1
        self._window_until_ns, self._on_loss = -1, "finish"
        self._is_lost = self._gives_back = False

    def lease(self, word: LeaseCommand, now_ns: int) -> None:
        """Somebody steers."""
        self._lease_until_ns = min(word.until_ns, now_ns + LEASE_MAX_NS)
        self._window_until_ns = -1 if word.window_until_ns is None else word.window_until_ns
        self._on_loss = word.on_loss

    def why_nobody(self, now_ns: int) -> str:
        """Why nobody may ask for anything; empty while somebody steers."""
        return say(SENTENCES, "guard.nobody") if now_ns > self._lease_until_ns else ""

    def ask(self, event: Event, mode: Mode, *, is_latched: bool, now_ns: int) -> str:
        """Why it may not happen; empty where control will be told.

        Args:
            event: What is asked for.
            mode: That control said last.
            is_latched: Whether the guard has stopped and was not reset. A reset comes here after the guard's own.
            now_ns: On CLOCK_MONOTONIC [ns].
        """
        if why := self.why_nobody(now_ns):
            return why
        if event not in ASKABLE or event is Event.PASSED:
            return say(SENTENCES, "guard.not_askable")
        if is_latched:
            return say(SENTENCES, "guard.stopped")
        if event is Event.TEST and mode is Mode.EXO_ONLY:
            self._ready_until_ns = now_ns + READY_NS  # step one once more
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
        """Whatever was asked for before a stop is void."""
        self._waiting.clear()
        self._ready_until_ns = -1

    def watch(self, mode: Mode, now_ns: int) -> str:
        """Look after the lease: a sentence when it was lost just now. To be called in every tick."""
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
        """Whether a window ran when the lease was lost, and the setting is to stop it."""
        return self._is_lost and self._on_loss == "stop" and self._window_until_ns > self._lease_until_ns

    def next(self) -> Event | None:
        """What control is to be told now, once."""
        return self._waiting.popleft() if self._waiting else None
