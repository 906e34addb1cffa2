"""Requests of the pages to a steered session, the answers, and the interface of the desk that takes them.

The module needs no process, engine or control, so that a server, a test and a rehearsal can use it.
`view_models.py` has the data that the pages show.
"""

from collections.abc import Mapping
from typing import Annotated, Any, Literal, Protocol, runtime_checkable

from pydantic import Field, TypeAdapter

from exograv.model.rig_settings import Settings
from exograv.model.scene import SceneDescription
from exograv.options import Side
from exograv.safety.guard import GRAVITY_LEVEL_MAX
from exograv.sentence import SentenceText

from .view_models import PlotTrace, SessionSnapshot, SkeletonLines

LATE_S = 0.5
"""Largest age of an act on arrival [s] (docs/explanation/safety.md, F33). Stop is never refused."""

READY_S = 30.0
"""Time after the machine was made ready in which the arm may be taken [s]."""

LEASE_S = 1.2
"""Time without a message from the operator's console after which the lease ends, and no page steers [s] (F31)."""

HEARTBEAT_S = 0.2
"""Period with which `Desk.keep` must be called while the operator's console is alive [s]."""

WINDOW_S = 22.0
"""Longest time after the loss of the lease in which an open window may be finished without an operator [s]."""

Who = Literal["operator", "therapist", "participant", "viewer"]
"""Role of the page that sent an act. The server sets the role, and a table of the server states which role may request
which act. Here the role is only recorded.
"""

Identifier = Annotated[str, Field(pattern=r"^[A-Za-z0-9_-]{8,64}$")]
Level = Annotated[float, Field(ge=0.0, le=GRAVITY_LEVEL_MAX)]
Line = Annotated[str, Field(min_length=1, max_length=500)]


class _Asked(Settings):
    """Fields that every act of a page has."""

    id: Identifier
    """Identifier made by the page. A repeated act gets the same answer and is not done again."""

    made_at_s: float
    """Time of the request on the clock of `Desk.now` [s]. The server has converted it from the page's clock."""


class _Seen(_Asked):
    """Act that may cause motion. It is refused if the state has changed since the page showed it."""

    seen_version: int
    """Value of `SessionSnapshot.version` when the button was pressed."""


class DonRequest(_Seen):
    """Request to change the person or the arm, while the machine is off. The new person has a file, or is unknown."""

    kind: Literal["don"] = "don"
    participant: Annotated[str, Field(pattern=r"^[A-Za-z0-9_-]{3,16}$")] | None = None
    """Code of a file, one of `SessionSnapshot.participants`; absent for an arm that is to be identified."""
    side: Side | None = None
    """Side of the arm, one of `SessionSnapshot.sides`; unchanged if absent. Files are of one side."""
    identify_s: Annotated[float, Field(ge=10.0, le=600.0)] = 60.0
    """Duration of the motion of an identification [s]."""


class MakeReady(_Seen):
    """Request for step one of two: a self-test, after which the machine carries itself but not the arm."""

    kind: Literal["make_ready"] = "make_ready"


class TakeArm(_Seen):
    """Request for step two with a known arm: a ramp after which the machine carries the arm.

    Only allowed soon after step one.
    """

    kind: Literal["take_arm"] = "take_arm"


class Identify(_Seen):
    """Request for step two with an unknown arm: the machine takes, moves and identifies the arm, then lets it float."""

    kind: Literal["identify"] = "identify"


class GiveBack(_Asked):
    """Request to return the arm's weight to the wearer by a ramp. The machine still carries itself."""

    kind: Literal["give_back"] = "give_back"


class Stop(_Asked):
    """Request for a soft descent of the arm. It is never refused, and a stop lasts until a reset.

    It is not an emergency stop.
    """

    kind: Literal["stop"] = "stop"
    why: Line = "Stop was pressed."


class Reset(_Seen):
    """Request to end a stop. The machine is off afterwards, and no motion starts."""

    kind: Literal["reset"] = "reset"


class SwitchOff(_Asked):
    """Request to end the machine's own support. Not allowed while the machine carries an arm."""

    kind: Literal["switch_off"] = "switch_off"


class SetLevel(_Asked):
    """Request to change the felt share of the arm's weight [-], with the guard's ramp or a slower one."""

    kind: Literal["set_level"] = "set_level"
    gravity_level: Level
    ramp_s: Annotated[float, Field(ge=0.0, le=60.0)] = 0.0
    """Shortest duration of the ramp [s]. The guard takes 5 s for the whole way from weightless to Earth."""


class LearnRest(_Seen):
    """Request to move the relaxed arm between two windows and to learn it. The arm floats again afterwards."""

    kind: Literal["learn_rest"] = "learn_rest"


class Agree(_Asked):
    """Consent of the participant that the machine pushes the arm down for a time, for levels above 1."""

    kind: Literal["agree"] = "agree"


class Note(_Asked):
    """Line of text for the recording. It must not contain names, because other people read recordings."""

    kind: Literal["note"] = "note"
    text: Line


class Acknowledge(_Asked):
    """Confirmation that a person has seen an alarm."""

    kind: Literal["acknowledge"] = "acknowledge"
    alarm: int
    """Number of the alarm."""


Act = Annotated[
    DonRequest
    | MakeReady
    | TakeArm
    | Identify
    | GiveBack
    | Stop
    | Reset
    | SwitchOff
    | SetLevel
    | LearnRest
    | Agree
    | Note
    | Acknowledge,
    Field(discriminator="kind"),
]
"""Any act that a page may request."""

ACT: TypeAdapter[Act] = TypeAdapter(Act)
"""Parser of acts: `ACT.validate_python(message)`. It rejects unknown kinds, unknown fields and non-finite numbers."""


class Answer(Settings):
    """Answer to an act."""

    id: str
    taken: bool
    why: SentenceText = ""
    """Sentence for the page that sent the act; empty if the act was taken."""


@runtime_checkable
class Desk(Protocol):
    """Steered session, as the server sees it.

    Every method may be called from any thread. `act` returns within `LATE_S`, the others immediately.
    """

    def now(self) -> float:
        """Time of the session's monotonic clock [s], used by `made_at_s`, alarms, and `write`."""
        ...

    def shown(self) -> SessionSnapshot:
        """Snapshot for the pages. It is computed at every call, so call it at most some ten times per second."""
        ...

    def trace(self, since: int) -> PlotTrace:
        """Return the samples to plot from number `since` on, at most the last ten seconds."""
        ...

    def skeleton(self) -> SkeletonLines:
        """Machine and arm as lines, at their present position."""
        ...

    def scene(self) -> SceneDescription | None:
        """Describe the picture of machine and person; None before there is one. The page draws it at each position."""
        ...

    def act(self, act: Act, by: Who) -> Answer:
        """Decide on an act, execute it, and answer. Waits for the guard, so do not call it in an event loop."""
        ...

    def keep(self, window_left_s: float | None = None, heard_s: float | None = None) -> None:
        """Renew the lease of the operator's console. Call it at least every `HEARTBEAT_S`.

        Args:
            window_left_s: Remaining time of a trial's open window [s]; absent without an open window.
            heard_s: Time at which the page's heartbeat was heard, on the clock of `now` [s]; absent if it is now.
        """
        ...

    def write(self, topic: str, t: float, message: Mapping[str, Any]) -> None:
        """Record a message with time `t` on the clock of `now` [s], such as the markers of `task` on `/task`.

        The message is lost while nothing is recorded.

        Raises:
            RecordingError: The message does not fit the recording format.
        """
        ...

    def close(self) -> None:
        """Lower the arm and end all processes. The call takes seconds."""
        ...
