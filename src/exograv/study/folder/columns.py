"""The tidy tables of a study, one row a touch, a window, a session, a participant: names, types, units, meanings.

Every source (our recordings, a CSV of touches, XDF) becomes these; measures, statistics and figures read nothing else.
Missing is NA. Times count from the beginning of the session's recording, right and down are positive on the screen.
"""

from dataclasses import dataclass
from types import NoneType
from typing import Any, Literal, get_args, get_origin

from exograv.recording.fields import described
from exograv.task.records import TouchRecord

Kind = Literal["string", "int64", "float64", "bool"]


@dataclass(frozen=True)
class Column:
    """One column of a table."""

    name: str
    kind: Kind
    unit: str
    """`-` where there is none."""

    meaning: str
    is_nullable: bool = False


KEY = (
    Column("participant", "string", "-", "pseudonymous code"),
    Column("protocol", "string", "-", "name of the protocol: `training`, `familiarisation`, `flight` or the study's"),
    Column("session", "int64", "-", "which one of this protocol it is for this person, from 1"),
)

KINDS: dict[object, Kind] = {int: "int64", float: "float64", bool: "bool"}
UNITS = {"px": "px", "mm": "mm", "s": "s", "Hz": "Hz", "Nm": "N·m", "Nms": "N·m·s", "deg": "°"}
"""Units by the last part of a name."""


def columns_of(row: type) -> tuple[Column, ...]:
    """Columns of a dataclass of rows: fields of type `Annotated[type, meaning]`; others have none.

    The unit is a second text where the name does not end with it.
    """
    return tuple(_column(name, *told) for name, told in described(row).items())


def _column(name: str, annotation: Any, meaning: str, unit: str | None = None) -> Column:
    kinds = (annotation,) if get_origin(annotation) is Literal else get_args(annotation) or (annotation,)
    by_name = UNITS.get(name.rpartition("_")[2], "-")
    return Column(name, KINDS.get(kinds[0], "string"), unit or by_name, meaning, NoneType in kinds)


def _recorded(*names: str) -> tuple[Column, ...]:
    """Columns of fields that the record of a touch has."""
    known = TouchRecord.model_fields
    return tuple(_column(name, known[name].annotation, known[name].description or "") for name in names)


TOUCHES = (
    *KEY,
    *_recorded("window", "attempt", "sequence", "page"),
    Column("t_s", "float64", "s", "when it fell"),
    *_recorded("is_accepted", "reason", "x_px", "y_px", "deviation_x_px", "deviation_y_px", "deviation_px"),
    *_recorded("deviation_x_mm", "deviation_y_mm", "deviation_mm"),
    Column("contact_px", "float64", "px", "size of the contact", is_nullable=True),
    *_recorded("interval_s", "pace"),
    Column("gravity_level", "float64", "-", "felt share of the arm's weight in the window", is_nullable=True),
)  # fmt: skip

WINDOWS = (
    *KEY,
    Column("window", "int64", "-", "from 1"),
    Column("attempt", "int64", "-", "from 1; more where it was broken off"),
    Column("opened_s", "float64", "s", "when it opened"),
    Column("closed_s", "float64", "s", "when it closed; NA where the recording ends before", is_nullable=True),
    Column("opened_by", "string", "-", "`clock`, `aircraft` or `hand`"),
    Column("closed_by", "string", "-", "as the task says it", is_nullable=True),
    Column("is_complete", "bool", "-", "it ran to its end"),
    Column("marks", "string", "-", "what is special, separated by `;`, such as `feed lost`; empty as a rule"),
    Column("gravity_level", "float64", "-", "felt share of the arm's weight"),
    Column("g_median", "float64", "g", "median norm of the aircraft's acceleration in it", is_nullable=True),
    Column("touches", "int64", "-", "touches that count"),
    Column("rejected", "int64", "-", "touches that do not"),
)

SESSIONS = (
    *KEY,
    Column("source", "string", "-", "path of the source within the study's folder"),
    Column("sha256", "string", "-", "of the source"),
    Column("kind", "string", "-", "`recording`, `csv` or `xdf`"),
    Column("is_simulated", "bool", "-", "nobody was there: a twin, or a model of a participant"),
    Column("is_complete", "bool", "-", "the protocol was run to its end"),
    Column("remark", "string", "-", "what is wrong with the source, as a sentence", is_nullable=True),
    Column("acquired", "string", "-", "date and time, ISO 8601, where somebody told it", is_nullable=True),
    Column("rig", "string", "-", "machine", is_nullable=True),
    Column("side", "string", "-", "arm", is_nullable=True),
    Column("exo", "string", "-", "`active` or `passive`, as the protocol asks for", is_nullable=True),
    Column("duration_s", "float64", "s", "of the recording"),
    Column("rate_Hz", "float64", "Hz", "ticks a second, nominal; NA without ticks", is_nullable=True),
    Column("pitch_x_mm", "float64", "mm", "a pixel across; NA on a screen that was not calibrated", is_nullable=True),
    Column("pitch_y_mm", "float64", "mm", "a pixel down; NA on a screen that was not calibrated", is_nullable=True),
    Column("windows_planned", "int64", "-", "of the protocol", is_nullable=True),
    Column("windows_complete", "int64", "-", "different windows that ran to their end"),
    Column("touches", "int64", "-", "that count"),
    Column("rejected", "int64", "-", "that do not"),
    Column("ticks", "int64", "-", "in the recording"),
    Column("ticks_lost", "int64", "-", "that should be there and are not", is_nullable=True),
    Column("clock_jumps", "int64", "-", "times that went back or leapt"),
    Column("stops", "int64", "-", "stops of the guard, or of somebody"),
    Column("left_over_Nm", "float64", "N·m", "largest RMS of a joint, by the session's own check", is_nullable=True),
    Column("software", "string", "-", "versions and hash of the code, `;` between", is_nullable=True),
    Column("protocol_sha256", "string", "-", "of the protocol's file", is_nullable=True),
    Column("calibration_sha256", "string", "-", "of the machine's calibration", is_nullable=True),
)  # fmt: skip

PARTICIPANTS = (
    Column("participant", "string", "-", "pseudonymous code, drawn at random"),
    Column("group", "string", "-", "`trained`, `untrained` or the study's; NA while it is sealed", is_nullable=True),
    Column("consent", "string", "-", "version of the consent that was signed", is_nullable=True),
    Column("age_band", "string", "-", "ten years, such as `30-39`", is_nullable=True),
    Column("sex", "string", "-", "as told", is_nullable=True),
    Column("height_band_cm", "string", "cm", "ten centimetres, such as `170-179`", is_nullable=True),
    Column("mass_band_kg", "string", "kg", "ten kilograms", is_nullable=True),
    Column("handedness", "string", "-", "as told", is_nullable=True),
)

TABLES = {"touches": TOUCHES, "windows": WINDOWS, "sessions": SESSIONS, "participants": PARTICIPANTS}
