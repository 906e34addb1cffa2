"""What a run says: one immutable record for each thing that happened, with a JSON form that stays the same."""

from typing import Annotated, Literal

from pydantic import Field, TypeAdapter

from exograv.model.rig_settings import Settings

from .pace import Pace
from .pointing import Reason
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


class TouchJudged(Settings):
    """One touch, exactly once."""

    kind: Literal["touch"] = "touch"
    t: float
    received: float
    page: str
    sequence: int
    window: int | None
    """In which it fell."""

    attempt: int | None
    is_accepted: bool
    reason: Reason | None
    """Why not."""

    x_px: float
    y_px: float
    deviation_x_px: float
    deviation_y_px: float
    deviation_px: float
    """Contact minus target, right and down, of the panel's pixels."""

    deviation_x_mm: float | None
    deviation_y_mm: float | None
    deviation_mm: float | None
    """None where the screen is not calibrated."""

    contact_px: float
    interval_s: float | None
    """Since the last accepted touch of the window, or since it opened; None outside."""

    pace: Pace | None
    """Of that interval."""


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


class Refused(Settings):
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
    | TouchJudged
    | PaceChanged
    | Paused
    | Resumed
    | RunEnded
    | Refused
    | AlarmRaised
    | AlarmAcknowledged
)
RECORD: TypeAdapter[Record] = TypeAdapter(Annotated[Record, Field(discriminator="kind")])
"""Reads a record from its JSON."""


def marker(record: Record) -> str:
    """Its JSON on one line, as it goes into the recording and out as an LSL marker."""
    return record.model_dump_json()
