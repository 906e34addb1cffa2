"""Rules for acts: each act once, soon after its request, for the shown state, and in the right order."""

from collections import OrderedDict
from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import get_args

from exograv.safety.modes import TRANSITIONS, Event, Mode

from .requests import LATE_S, LEASE_S, Act, Answer
from .sentences import say
from .view_models import ActKind

REMEMBERED = 4096
"""Number of stored answers for repeated acts: ten seconds at the highest rate of the pages."""

KINDS: tuple[ActKind, ...] = get_args(ActKind)

ALWAYS: frozenset[ActKind] = frozenset({"stop", "note", "acknowledge"})
"""Kinds of acts that move no joint, or lower the arm. They are possible without a lease."""

EVENTS: Mapping[ActKind, Event] = MappingProxyType(
    {
        "make_ready": Event.TEST,
        "take_arm": Event.TAKE_ARM,
        "identify": Event.TAKE_ARM,
        "give_back": Event.GIVE_BACK,
        "reset": Event.RESET,
        "switch_off": Event.SWITCH_OFF,
    }
)
"""Event that each kind of act requests. The guard's process checks the event again."""

LEVEL_IN = frozenset({Mode.OFF, Mode.SELF_TEST, Mode.EXO_ONLY, Mode.RAMP_IN, Mode.FLOATING})
"""Modes in which another gravity level may be requested: not on a path, and not while the weight returns to the person.
"""


@dataclass(frozen=True)
class RequestContext:
    """State of the session, as far as an act depends on it."""

    version: int
    mode: Mode | None
    latch: str | None
    is_known: bool
    is_learned: bool
    is_ready: bool
    """True if step one was done not too long ago."""
    is_leased: bool
    participants: tuple[str, ...]
    sides: tuple[str, ...] = ()
    why_no_rest: str = ""
    """Reason why the machine cannot learn in a rest now, as far as the machine knows."""
    is_in_rest: bool = False
    """True while the machine learns in a rest."""
    failure: str = ""
    """Reason why no guard runs any more. Then the only possible act is a new person."""


def why_not(kind: ActKind, s: RequestContext) -> str:
    """Reason why an act of this kind is refused now; empty if it is allowed."""
    if kind in ALWAYS:
        return ""
    if s.mode is None:
        return say("desk.not_begun")
    if not s.is_leased:
        return say("desk.nobody", seconds=f"{LEASE_S:g}")
    if s.failure:
        return "" if kind == "don" else s.failure
    if kind == "reset":
        return "" if s.latch is not None or s.mode is Mode.SAFE else say("desk.not_stopped")
    if s.latch is not None:
        return say("desk.stopped", latch=s.latch)
    return _out_of_place(kind, s, s.mode) or _out_of_turn(kind, s)


def _out_of_place(kind: ActKind, s: RequestContext, mode: Mode) -> str:
    if kind == "don":
        possible = mode is Mode.OFF
    elif kind == "set_level":
        possible = mode in LEVEL_IN
    elif kind in ("agree", "learn_rest"):
        possible = mode is Mode.FLOATING
    else:
        possible = (mode, EVENTS[kind]) in TRANSITIONS or (kind == "make_ready" and mode is Mode.EXO_ONLY)
    return "" if possible else say("desk.not_possible", mode=mode.sentence)


def _out_of_turn(kind: ActKind, s: RequestContext) -> str:
    """Check the order: two steps before an arm is taken, and the second step that fits the arm."""
    if kind in ("take_arm", "identify") and not s.is_ready:
        return say("desk.no_step_one")
    if kind == "set_level" and s.is_in_rest:
        return say("rest.runs")
    if kind == "learn_rest":
        return s.why_no_rest
    # An arm is identified or checked while its whole weight is carried.
    if kind == "set_level" and s.is_known and not s.is_learned:
        return say("desk.unchecked")
    if kind in ("take_arm", "set_level") and not s.is_known:
        return say("desk.unknown_arm")
    if kind == "identify" and s.is_known:
        return say("desk.known_arm")
    return ""


class RequestValidator:
    """Checks of one desk, with its memory of answers."""

    def __init__(self):
        self._answers: OrderedDict[str, tuple[Act, Answer]] = OrderedDict()

    def known(self, act: Act) -> Answer | None:
        """Earlier answer to an act with this identifier."""
        before = self._answers.get(act.id)
        if before is None:
            return None
        same = before[0] == act
        return before[1] if same else Answer(id=act.id, taken=False, why=say("desk.same_id"))

    def refusal(self, act: Act, now: float, s: RequestContext) -> str:
        """Reason why this act is refused; empty if it is allowed."""
        if act.kind != "stop" and not now - LATE_S <= act.made_at_s <= now + LATE_S:
            return say("desk.late", seconds=f"{now - act.made_at_s:.1f}", allowed=f"{LATE_S:g}")
        seen = getattr(act, "seen_version", None)
        if seen is not None and seen != s.version:
            return say("desk.changed")
        if why := why_not(act.kind, s):
            return why
        if act.kind == "don" and act.side is not None and act.side not in s.sides:
            return say("desk.no_side", side=act.side, sides=", ".join(s.sides))
        if act.kind == "don" and act.participant is not None and act.participant not in s.participants:
            return say("desk.no_file", person=act.participant, people=", ".join(s.participants) or "-")
        return ""

    def remember(self, act: Act, answer: Answer) -> Answer:
        """Store an answer, and return it."""
        self._answers[act.id] = act, answer
        if len(self._answers) > REMEMBERED:
            self._answers.popitem(last=False)
        return answer
