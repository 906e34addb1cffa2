"""Records of a run: one immutable record per event, with a stable JSON form."""

from typing import Annotated, Literal, TypeVar

from pydantic import Field, TypeAdapter

from exograv.model.rig_settings import Settings

from .pace import Pace
from .pointing import RejectionReason
from .schedule import PhaseKind

ClosedBy = Literal["clock", "aircraft", "hand", "pause", "stop", "interruption"]
Mark = Literal["feed lost", "overtime", "short", "not confirmed"]
"""Special property of a window."""


class RunBegan(Settings):
    """Start of a run. The record does not tell a real machine from a sham."""

    kind: Literal["run_began"] = "run_began"
    t: float
    protocol: str
    protocol_sha256: str
    pitch_mm: tuple[float, float] | None
    """Size of a pixel of the screen, across and down; None without calibration."""

    windows: int | None = None
    """Number of windows of the protocol; None in earlier recordings."""

    participant: str | None = None
    session: int | None = None
    """Person and number of the session; None if the settings of the recording state them."""


class PhaseBegan(Settings):
    """Start of a phase of the schedule."""

    kind: Literal["phase_began"] = "phase_began"
    t: float
    phase: PhaseKind
    window: int
    duration_s: float
    gravity_level: float
    gravity_level_end: float
    """Gravity level at the end of the phase [-]. Both levels are as the protocol states them."""


class WindowOpened(Settings):
    """Start of a window, in which the participant may move."""

    kind: Literal["window_opened"] = "window_opened"
    t: float
    window: int
    attempt: int
    """Number of the attempt, from 1. It is above 1 after a window was broken off."""

    by: Literal["clock", "aircraft", "hand"]
    gravity_level: float
    since: float | None = None
    parabola: int | None = None
    confirmed: bool | None = None


class WindowClosed(Settings):
    """End of a window. The participant rests."""

    kind: Literal["window_closed"] = "window_closed"
    t: float
    window: int
    attempt: int
    by: ClosedBy
    is_complete: bool
    marks: tuple[Mark, ...]


NOT_CALIBRATED = Field(description="NA on a screen that was not calibrated")


class TouchRecord(Settings):
    """Touch, recorded exactly once. Recording, markers, checkpoints and the table of touches have the same fields."""

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
    """New pace that the arrow shows, if the protocol shows the pace."""

    kind: Literal["pace_changed"] = "pace_changed"
    t: float
    window: int
    pace: Pace
    is_shown: bool


class Paused(Settings):
    """Interruption of the run."""

    kind: Literal["paused"] = "paused"
    t: float
    why: str


class Resumed(Settings):
    """Continuation of the run."""

    kind: Literal["resumed"] = "resumed"
    t: float
    window: int
    approach_t: float
    """Time from which the schedule counts again [s]."""


class RunEnded(Settings):
    """End of the run. Only late touches may follow."""

    kind: Literal["run_ended"] = "run_ended"
    t: float
    is_complete: bool
    why: str


class RefusedEvent(Settings):
    """Event that is not possible in the present state. The state did not change."""

    kind: Literal["refused"] = "refused"
    t: float
    event: str
    why: str


class AlarmRaised(Settings):
    """Alarm for the operator."""

    kind: Literal["alarm_raised"] = "alarm_raised"
    t: float
    alarm: int
    text: str


class AlarmAcknowledged(Settings):
    """Confirmation that the operator has seen an alarm."""

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
    """Make a `target` from the fields that it shares with `source`, and from `more`."""
    common = {name: getattr(source, name) for name in target.model_fields if name in type(source).model_fields}
    return target.model_validate({**common, **more})


def marker(record: Record) -> str:
    """Return the JSON of a record on one line, as it goes into the recording and out as an LSL marker."""
    return record.model_dump_json()
