"""Desk of a steered session: it takes acts from pages, decides about each once, and lets a flight execute them."""

import threading
from collections.abc import Mapping
from typing import Any

from exograv.model.scene import SceneDescription
from exograv.safety.modes import Mode
from exograv.sentence import support_text

from .alarms import AlarmBook, Priority
from .interface import FlightMoment, SteeredFlight
from .request_validation import EVENTS, KINDS, RequestContext, RequestValidator, why_not
from .requests import (
    LEASE_S,
    READY_S,
    Acknowledge,
    Act,
    Agree,
    Answer,
    DonRequest,
    LearnRest,
    MakeReady,
    Note,
    SetLevel,
    Stop,
    Who,
)
from .sentences import say
from .view_models import ModeName, PlotTrace, SessionSnapshot, SkeletonLines

RECORD_TOPIC = "/act"
"""Topic of the record of each act: request, sender and answer."""

BEFORE_ARM = (None, Mode.OFF, Mode.SELF_TEST, Mode.EXO_ONLY)
"""Modes from the request to make the machine ready on. The processes of a machine on drives start only then."""


class SessionController:
    """`Desk` over a flight."""

    def __init__(self, flight: SteeredFlight):
        self._flight, self._lock = flight, threading.Lock()
        self._reception, self._alarms = RequestValidator(), AlarmBook()
        self._version, self._key = 0, ()
        self._ready_until_s: float | None = None
        self._lease_until_s: float | None = None
        self._has_lapsed = False
        self._was_mode: Mode | None = None

    def now(self) -> float:
        """Time of the flight's clock [s]."""
        return self._flight.now()

    def shown(self) -> SessionSnapshot:
        """Snapshot for the pages."""
        with self._lock:
            now, moment = self.now(), self._flight.moment()
            s = self._standing(moment, now)
            said = {name: value for name, value in vars(moment).items() if name in SessionSnapshot.model_fields}
            mode: ModeName = "starting" if moment.mode is None else moment.mode.name.lower()  # pyright: ignore[reportAssignmentType]
            return SessionSnapshot(**said | {
                "version": s.version,
                "t": now,
                "mode": mode,
                "mode_text": moment.failure or _mode_text(moment),
                "take_within_s": _left(self._ready_until_s, now),
                "possible": tuple(kind for kind in KINDS if not why_not(kind, s)),
                "lease_left_s": _left(self._lease_until_s, now),
                "alarms": self._alarms.shown,
            })  # fmt: skip

    def trace(self, since: int) -> PlotTrace:
        """Return the samples to plot, from the flight."""
        return self._flight.trace(since)

    def skeleton(self) -> SkeletonLines:
        """Lines of machine and arm, from the flight."""
        return self._flight.skeleton()

    def scene(self) -> SceneDescription | None:
        """Picture of machine and person, from the flight."""
        return self._flight.scene()

    def act(self, act: Act, by: Who) -> Answer:
        """Decide on an act, execute it, and answer."""
        if isinstance(act, Stop):
            self._flight.stop()  # Stop must not wait for the lock of another act.
        with self._lock:
            now, moment = self.now(), self._flight.moment()
            s = self._standing(moment, now)
            if (before := self._reception.known(act)) is not None:
                return before
            why = self._reception.refusal(act, now, s) or self._done(act, by, now)
            answer = self._reception.remember(act, Answer(id=act.id, taken=not why, why=why))
            said = act.model_dump(mode="json") | {"by": by, "taken": answer.taken, "why": why}
            if isinstance(act, SetLevel):
                said["support"] = support_text(act.gravity_level)
            self._flight.write(RECORD_TOPIC, now, said)
            return answer

    def keep(self, window_left_s: float | None = None, heard_s: float | None = None) -> None:
        """Renew the lease of the steering page at the guard. A heartbeat that waited counts from when it was heard."""
        now = self.now()
        # A lease may end and begin again between two looks, when this process stood still.
        self._has_lapsed |= self._lease_until_s is not None and self._lease_until_s <= now
        self._lease_until_s = (now if heard_s is None else min(heard_s, now)) + LEASE_S
        self._flight.lease(self._lease_until_s, window_left_s)

    def write(self, topic: str, t: float, message: Mapping[str, Any]) -> None:
        """Record a message through the flight."""
        self._flight.write(topic, t, message)

    def close(self) -> None:
        """End the flight and its processes."""
        self._flight.close()

    def _done(self, act: Act, by: Who, now: float) -> str:
        """Execute an act. Return the reason if it failed; empty if it succeeded."""
        if isinstance(act, Acknowledge):
            return "" if self._alarms.acknowledge(act.alarm, by) else say("desk.no_alarm", number=act.alarm)
        if isinstance(act, Note | Stop):
            return ""
        if isinstance(act, SetLevel):
            return self._flight.feel(act.gravity_level, act.ramp_s)
        if isinstance(act, Agree):
            return self._flight.agree()
        if isinstance(act, LearnRest):
            return self._flight.learn_in_rest()
        if isinstance(act, DonRequest):
            return self._flight.don(act)
        why = self._flight.ask(EVENTS[act.kind])
        if not why:
            self._ready_until_s = now + READY_S if isinstance(act, MakeReady) else None
        return why

    def _standing(self, moment: FlightMoment, now: float) -> RequestContext:
        """State for the validation. Also counts the version and raises alarms."""
        is_leased = _left(self._lease_until_s, now) is not None
        if moment.latch is not None or not is_leased or moment.mode not in BEFORE_ARM:
            self._ready_until_s = None
        is_ready = _left(self._ready_until_s, now) is not None
        key = (moment.mode, moment.latch, is_ready, moment.participant, moment.is_known, moment.side)
        if key != self._key:
            self._key, self._version = key, self._version + 1
        is_lost = self._lease_until_s is not None and not is_leased
        if self._has_lapsed and not is_lost:
            self._look_for_alarms(moment, now, is_lost=True)  # an alarm for a loss that is already over
        self._has_lapsed = False
        self._look_for_alarms(moment, now, is_lost=is_lost)
        return RequestContext(
            self._version,
            moment.mode,
            moment.latch,
            moment.is_known,
            moment.is_learned,
            is_ready,
            is_leased,
            moment.participants,
            moment.sides,
            say("rest.unlearned") if moment.rests is None else moment.rests.why_not,
            moment.rests is not None and moment.rests.is_active,
            moment.failure,
        )

    def _look_for_alarms(self, moment: FlightMoment, now: float, *, is_lost: bool) -> None:
        causes: dict[str, Priority] = {}
        for text in moment.warnings:
            causes[text] = "medium"
        if moment.failure:
            causes[moment.failure] = "high"
        if moment.latch is not None:
            causes[moment.latch] = "high"
        if is_lost:
            causes[say("desk.nobody_any_more")] = "medium"
        if moment.recorded is not None and not moment.recorded.is_ok:
            causes[moment.recorded.why] = "medium"
        self._alarms.look(causes, now)


def _mode_text(moment: FlightMoment) -> str:
    """Sentence about the mode; after a stop, its reason."""
    if moment.mode is None:
        return moment.doing
    if moment.mode is Mode.SAFE and moment.latch is not None:
        return say("desk.let_down", latch=moment.latch)
    return moment.mode.sentence


def _left(until: float | None, now: float) -> float | None:
    """Remaining time until `until` [s]; None without a time, or after it."""
    return None if until is None or until <= now else until - now
