"""Columns of a study's tidy tables, one row per touch, window, session or participant: names, types, units, meanings.

Every source (our recordings, a CSV of touches, XDF) becomes these tables; measures, statistics and figures read nothing
else. A missing value is NA. Times count from the beginning of the session's recording. Right and down are positive on
the screen.
"""

from dataclasses import dataclass
from types import NoneType
from typing import Any, Literal, get_args, get_origin

from exograv.recording.fields import described
from exograv.task.records import TouchRecord

Kind = Literal["string", "int64", "float64", "bool"]


@dataclass(frozen=True)
class Column:
    """Column of a table."""

    name: str
    kind: Kind
    unit: str
    """Unit of the values, or `-` for a column without a unit."""

    meaning: str
    is_nullable: bool = False


KEY = (
    Column("participant", "string", "-", "pseudonymous code of the participant"),
    Column("protocol", "string", "-", "`training`, `familiarisation`, `flight` or a protocol of the study"),
    Column("session", "int64", "-", "number of the participant's session in this protocol, from 1"),
)

KINDS: dict[object, Kind] = {int: "int64", float: "float64", bool: "bool"}
UNITS = {"px": "px", "mm": "mm", "s": "s", "Hz": "Hz", "Nm": "N·m", "Nms": "N·m·s", "deg": "°"}
"""Units by the last part of a column's name."""


def columns_of(row: type) -> tuple[Column, ...]:
    """Return the columns of a dataclass of rows: its fields of type `Annotated[type, meaning]`.

    The unit is a second text in `Annotated` if the field's name does not end with it.
    """
    return tuple(_column(name, *told) for name, told in described(row).items())


def _column(name: str, annotation: Any, meaning: str, unit: str | None = None) -> Column:
    kinds = (annotation,) if get_origin(annotation) is Literal else get_args(annotation) or (annotation,)
    by_name = UNITS.get(name.rpartition("_")[2], "-")
    return Column(name, KINDS.get(kinds[0], "string"), unit or by_name, meaning, NoneType in kinds)


def _recorded(*names: str) -> tuple[Column, ...]:
    """Return columns for fields of a touch's record."""
    known = TouchRecord.model_fields
    return tuple(_column(name, known[name].annotation, known[name].description or "") for name in names)


TOUCHES = (
    *KEY,
    *_recorded("window", "attempt", "sequence", "page"),
    Column("t_s", "float64", "s", "time of the touch"),
    *_recorded("is_accepted", "reason", "x_px", "y_px", "deviation_x_px", "deviation_y_px", "deviation_px"),
    *_recorded("deviation_x_mm", "deviation_y_mm", "deviation_mm"),
    Column("contact_px", "float64", "px", "size of the finger's contact", is_nullable=True),
    *_recorded("interval_s", "pace"),
    Column("gravity_level", "float64", "-", "felt share of the arm's weight: 0 weightless, 1 Earth", is_nullable=True),
)  # fmt: skip

WINDOWS = (
    *KEY,
    Column("window", "int64", "-", "number of the window, from 1"),
    Column(
        "attempt", "int64", "-", "number of the attempt at the window, from 1; more than 1 after an interrupted attempt"
    ),
    Column("opened_s", "float64", "s", "time at which the window opened"),
    Column(
        "closed_s", "float64", "s", "time at which the window closed; NA if the recording ends first", is_nullable=True
    ),
    Column("opened_by", "string", "-", "`clock`, `aircraft` or `hand`"),
    Column("closed_by", "string", "-", "reason why the window closed, from the task's record", is_nullable=True),
    Column("is_complete", "bool", "-", "true if the window ran to its end"),
    Column("marks", "string", "-", "special events, separated by `;`, such as `feed lost`; usually empty"),
    Column("gravity_level", "float64", "-", "felt share of the arm's weight: 0 weightless, 1 Earth"),
    Column("g_median", "float64", "g", "median norm of the aircraft's acceleration in the window", is_nullable=True),
    Column("touches", "int64", "-", "number of accepted touches"),
    Column("rejected", "int64", "-", "number of rejected touches"),
)

SESSIONS = (
    *KEY,
    Column("source", "string", "-", "path of the source within the study's folder"),
    Column("sha256", "string", "-", "SHA-256 of the source"),
    Column("kind", "string", "-", "`recording`, `csv` or `xdf`"),
    Column("is_simulated", "bool", "-", "true if a twin or a model of a participant made the data, without a person"),
    Column("is_complete", "bool", "-", "true if the protocol ran to its end"),
    Column("remark", "string", "-", "problems of the source, in sentences", is_nullable=True),
    Column("acquired", "string", "-", "date and time of the recording, ISO 8601; NA if not stated", is_nullable=True),
    Column("rig", "string", "-", "name of the machine", is_nullable=True),
    Column("side", "string", "-", "side of the arm in the machine", is_nullable=True),
    Column("exo", "string", "-", "`active` or `passive`, mode of the exoskeleton in the protocol", is_nullable=True),
    Column("duration_s", "float64", "s", "duration of the recording"),
    Column("rate_Hz", "float64", "Hz", "nominal number of ticks per second; NA without ticks", is_nullable=True),
    Column("pitch_x_mm", "float64", "mm", "width of a pixel; NA if the screen was not calibrated", is_nullable=True),
    Column("pitch_y_mm", "float64", "mm", "height of a pixel; NA if the screen was not calibrated", is_nullable=True),
    Column("windows_planned", "int64", "-", "number of windows in the protocol", is_nullable=True),
    Column("windows_complete", "int64", "-", "number of different windows that ran to their end"),
    Column("touches", "int64", "-", "number of accepted touches"),
    Column("rejected", "int64", "-", "number of rejected touches"),
    Column("ticks", "int64", "-", "number of ticks in the recording"),
    Column("ticks_lost", "int64", "-", "number of missing ticks", is_nullable=True),
    Column("clock_jumps", "int64", "-", "number of times that a clock went back or jumped ahead"),
    Column("stops", "int64", "-", "number of stops, by the guard or by a person"),
    Column("left_over_Nm", "float64", "N·m", "largest left over (RMS) of a joint, as verified", is_nullable=True),
    Column("software", "string", "-", "versions and hash of the code, separated by `;`", is_nullable=True),
    Column("protocol_sha256", "string", "-", "SHA-256 of the protocol's file", is_nullable=True),
    Column("calibration_sha256", "string", "-", "SHA-256 of the machine's calibration", is_nullable=True),
)  # fmt: skip

PARTICIPANTS = (
    Column("participant", "string", "-", "pseudonymous code of the participant, drawn at random"),
    Column(
        "group",
        "string",
        "-",
        "`trained`, `untrained` or a group of the study; NA while sealed",
        is_nullable=True,
    ),
    Column("consent", "string", "-", "version of the signed consent", is_nullable=True),
    Column("age_band", "string", "-", "age in bands of ten years, such as `30-39`", is_nullable=True),
    Column("sex", "string", "-", "sex as stated by the participant", is_nullable=True),
    Column(
        "height_band_cm", "string", "cm", "body height in bands of ten centimetres, such as `170-179`", is_nullable=True
    ),
    Column("mass_band_kg", "string", "kg", "body mass in bands of ten kilograms", is_nullable=True),
    Column("handedness", "string", "-", "handedness as stated by the participant", is_nullable=True),
)

TABLES = {"touches": TOUCHES, "windows": WINDOWS, "sessions": SESSIONS, "participants": PARTICIPANTS}
