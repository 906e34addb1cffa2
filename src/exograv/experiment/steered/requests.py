"""Between pages and a steered session: what may be asked for, what is answered, and the desk that takes it.

No process, no engine and no control in here: a server, a test and a rehearsal need nothing else. What is shown stands
in `shown.py`.
"""

from collections.abc import Mapping
from typing import Annotated, Any, Literal, Protocol, runtime_checkable

from pydantic import Field, TypeAdapter

from exograv.model.rig_settings import Settings
from exograv.options import Side
from exograv.sentence import SentenceText

from .view_models import PlotTrace, SessionSnapshot, SkeletonLines

LATE_S = 0.5
"""An act that is older when it arrives is refused (docs/explanation/safety.md, F33); Stop never is."""

READY_S = 30.0
"""So long after the machine was made ready may the arm be taken."""

LEASE_S = 1.2
"""Without a word from the operator's console for so long, nobody steers any more (F31)."""

HEARTBEAT_S = 0.2
"""How often `Desk.keep` is to be called while the operator's console is alive."""

WINDOW_S = 22.0
"""A window that has begun may be finished without an operator; no later than so long after the lease was lost."""

Who = Literal["operator", "therapist", "participant", "viewer"]
"""Whose page an act came from: the server knows, the page does not say. Which role may ask for what is the server's
table; here it is recorded."""

Identifier = Annotated[str, Field(pattern=r"^[A-Za-z0-9_-]{8,64}$")]
Level = Annotated[float, Field(ge=0.0, le=1.0)]
Line = Annotated[str, Field(min_length=1, max_length=500)]


class _Asked(Settings):
    """What all acts have."""

    id: Identifier
    """Made by the page. The same once more is answered as before, and nothing is done twice."""

    made_at_s: float
    """On `Desk.now`'s clock, to which the server has fitted the page's [s]."""


class _Seen(_Asked):
    """An act that may set something in motion: refused unless it was asked for what is there."""

    seen_version: int
    """`SessionSnapshot.version` when the button was pressed."""


class DonRequest(_Seen):
    """Somebody else is put into the machine, or another arm, while it is off: begin with a file, or nobody known."""

    kind: Literal["don"] = "don"
    participant: Annotated[str, Field(pattern=r"^[A-Za-z0-9_-]{3,16}$")] | None = None
    """Code of a file, one of `SessionSnapshot.participants`; absent for an arm that is to be identified."""
    side: Side | None = None
    """Whose arm: one of `SessionSnapshot.sides`; as before where absent. Files are of one side."""
    identify_s: Annotated[float, Field(ge=10.0, le=600.0)] = 60.0
    """Of motion, when it is identified [s]."""


class MakeReady(_Seen):
    """Step one of two: the self-test, then the machine carries itself. No weight of the arm is carried."""

    kind: Literal["make_ready"] = "make_ready"


class TakeArm(_Seen):
    """Step two: the machine takes over the weight of an arm that is known, by a ramp. Only soon after step one."""

    kind: Literal["take_arm"] = "take_arm"


class Identify(_Seen):
    """Step two where the arm is not known: it is taken and moved, learned, and let float."""

    kind: Literal["identify"] = "identify"


class GiveBack(_Asked):
    """The arm's weight is given back by a ramp; the machine goes on carrying itself."""

    kind: Literal["give_back"] = "give_back"


class Stop(_Asked):
    """The arm comes down softly, and the latch stays until a reset. Never refused; no emergency stop."""

    kind: Literal["stop"] = "stop"
    why: Line = "Stop was pressed."


class Reset(_Seen):
    """The latch is left, and the machine is off. Nothing begins."""

    kind: Literal["reset"] = "reset"


class SwitchOff(_Asked):
    """The machine stops carrying itself. Not while it carries an arm."""

    kind: Literal["switch_off"] = "switch_off"


class SetLevel(_Asked):
    """Another share of the arm's weight is to be felt, by the guard's ramp; with a slower one where so asked for."""

    kind: Literal["set_level"] = "set_level"
    gravity_level: Level
    ramp_s: Annotated[float, Field(ge=0.0, le=60.0)] = 0.0
    """At least; the guard takes 5 s for the whole way from weightless to Earth [s]."""


class Note(_Asked):
    """A line for the recording. No names: recordings are read by others."""

    kind: Literal["note"] = "note"
    text: Line


class Acknowledge(_Asked):
    """Somebody has seen an alarm."""

    kind: Literal["acknowledge"] = "acknowledge"
    alarm: int
    """Its number."""


Act = Annotated[
    DonRequest | MakeReady | TakeArm | Identify | GiveBack | Stop | Reset | SwitchOff | SetLevel | Note | Acknowledge,
    Field(discriminator="kind"),
]
"""Everything that may be asked for."""

ACT: TypeAdapter[Act] = TypeAdapter(Act)
"""Reads one: `ACT.validate_python(message)`; refuses unknown kinds, fields and numbers that are none."""


class Answer(Settings):
    """What became of an act."""

    id: str
    taken: bool
    why: SentenceText = ""
    """A sentence for whoever asked; empty where it was taken and there is nothing to say."""


@runtime_checkable
class Desk(Protocol):
    """A steered session, as the server sees it.

    Every method may be called from any thread, and returns soon: `act` within `LATE_S`, the others at once.
    """

    def now(self) -> float:
        """The session's monotonic clock [s]: of `made_at_s`, alarms, and `write`."""
        ...

    def shown(self) -> SessionSnapshot:
        """What pages show; made anew at every call, so ask some ten times a second at most."""
        ...

    def trace(self, since: int) -> PlotTrace:
        """Samples to plot, from number `since` on; at most the last ten seconds."""
        ...

    def skeleton(self) -> SkeletonLines:
        """Machine and arm as lines, where they are now."""
        ...

    def act(self, act: Act, by: Who) -> Answer:
        """Decide, do, answer. Waits for the guard's word; not to be called in an event loop."""
        ...

    def keep(self, window_left_s: float | None = None) -> None:
        """The operator's console is alive: to be called at least every `HEARTBEAT_S`.

        Args:
            window_left_s: Of a trial's window that runs [s]; absent where none does.
        """
        ...

    def write(self, topic: str, t: float, message: Mapping[str, Any]) -> None:
        """Have a message of this time of `now` [s] recorded; `task`'s markers on `/task`.

        It is lost while nothing is recorded.
        """
        ...

    def close(self) -> None:
        """The arm comes down, all ends; takes seconds."""
        ...
