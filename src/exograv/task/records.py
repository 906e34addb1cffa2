"""What a run says: one immutable record for each thing that happened, with a JSON form that stays the same."""

from typing import Annotated, Literal, TypeVar

from pydantic import Field, TypeAdapter

from exograv.model.rig_settings import Settings

from .pace import Pace
from .pointing import RejectionReason
from .schedule import PhaseKind

ClosedBy = Literal["clock", "aircraft", "hand", "pause", "stop", "interruption"]
Mark = Literal["feed lost", "overtime", "short", "not confirmed"]
"""What is special about a window."""


class RunBegan(Settings):
    """What is run; whether a machine is real or a sham is not said."""

    kind: Literal["run_began"] = "run_began"
    t: float
    protocol: str
    protocol_sha256: str
    pitch_mm: tuple[float, float] | None
    """Of the screen, across and down; None where it is not calibrated."""


class PhaseBegan(Settings):
    """Of the schedule."""

    kind: Literal["phase_began"] = "phase_began"
    t: float
    phase: PhaseKind
    window: int
    duration_s: float
    gravity_level: float
    gravity_level_end: float
    """As the protocol states it."""


class WindowOpened(Settings):
    """The participant may move."""

    kind: Literal["window_opened"] = "window_opened"
    t: float
    window: int
    attempt: int
    """From 1; more where a window was broken off."""

    by: Literal["clock", "aircraft", "hand"]
    gravity_level: float
    since: float | None = None
    parabola: int | None = None
    confirmed: bool | None = None


class WindowClosed(Settings):
    """The participant rests."""

    kind: Literal["window_closed"] = "window_closed"
    t: float
    window: int
    attempt: int
    by: ClosedBy
    is_complete: bool
    marks: tuple[Mark, ...]


NOT_CALIBRATED = Field(description="NA on a screen that was not calibrated")


class TouchRecord(Settings):
    """One touch, exactly once. The same fields in recording, markers, checkpoints and the table of touches."""

    kind: Literal["touch"] = "touch"
    t: float
    received: float
    page: str = Field(description="which page sent it")
    sequence: int = Field(description="number that the page gave it; with `page` unique in a session")
    window: int | None = Field(description="in which it fell; NA outside of windows")
    attempt: int | None = Field(description="of the window, from 1; NA outside of windows")
    is_accepted: bool = Field(description="it counts")
    reason: RejectionReason | None = Field(description="why it does not count")
    x_px: float = Field(description="contact on the panel, right")
    y_px: float = Field(description="contact on the panel, down")
    deviation_x_px: float = Field(description="contact minus target, right")
    deviation_y_px: float = Field(description="contact minus target, down")
    deviation_px: float = Field(description="its length")
    deviation_x_mm: float | None = NOT_CALIBRATED
    deviation_y_mm: float | None = NOT_CALIBRATED
    deviation_mm: float | None = NOT_CALIBRATED
    contact_px: float
    interval_s: float | None = Field(description="since the last that counts, or since the window opened")
    pace: Pace | None = Field(description="`too_short`, `right` or `too_long`")


class PaceChanged(Settings):
    """What the arrow tells from now on; shown only where the protocol shows it."""

    kind: Literal["pace_changed"] = "pace_changed"
    t: float
    window: int
    pace: Pace
    is_shown: bool


class Paused(Settings):
    """The run stands."""

    kind: Literal["paused"] = "paused"
    t: float
    why: str


class Resumed(Settings):
    """The run goes on."""

    kind: Literal["resumed"] = "resumed"
    t: float
    window: int
    approach_t: float
    """From when on the schedule counts again."""


class RunEnded(Settings):
    """Nothing comes after it but late touches."""

    kind: Literal["run_ended"] = "run_ended"
    t: float
    is_complete: bool
    why: str


class RefusedEvent(Settings):
    """An event that cannot be now; nothing has changed."""

    kind: Literal["refused"] = "refused"
    t: float
    event: str
    why: str


class AlarmRaised(Settings):
    """The operator has to know."""

    kind: Literal["alarm_raised"] = "alarm_raised"
    t: float
    alarm: int
    text: str


class AlarmAcknowledged(Settings):
    """The operator knows."""

    kind: Literal["alarm_acknowledged"] = "alarm_acknowledged"
    t: float
    alarm: int


Record = (
    RunBegan
    | PhaseBegan
    | WindowOpened
    | WindowClosed
    | TouchRecord
    | PaceChanged
    | Paused
    | Resumed
    | RunEnded
    | RefusedEvent
    | AlarmRaised
    | AlarmAcknowledged
)
RECORD: TypeAdapter[Record] = TypeAdapter(Annotated[Record, Field(discriminator="kind")])
"""Reads a record from its JSON."""


Target = TypeVar("Target", bound=Settings)


def extended(source: Settings, target: type[Target], **more: object) -> Target:
    """Make a `target` of the fields that `source` has too, and of `more`."""
    common = {name: getattr(source, name) for name in target.model_fields if name in type(source).model_fields}
    return target.model_validate({**common, **more})


def marker(record: Record) -> str:
    """Its JSON on one line, as it goes into the recording and out as an LSL marker."""
    return record.model_dump_json()
