"""The recording format in one table: writer, reader and docs/recording_format.md are made from it."""

import math
from dataclasses import dataclass

SCHEMA_VERSION = 2
"""Raised whenever an old reader would misread a new file; this one reads all from 1 on."""

Size = tuple[str | int, ...]
"""Length of each dimension: a number, `joint` (actuated joints of the file) or `any`; () is a single value."""


@dataclass(frozen=True)
class Field:
    """One value of a message."""

    name: str
    type: str
    """A ROS 2 type (`float64`, `float32`, `uint32`) in a binary channel, a JSON type otherwise.

    An `object` holds `fields`, or anything if there are none.
    """

    unit: str
    meaning: str
    size: Size = ()
    optional: bool = False
    """May be absent."""

    nullable: bool = False
    """May be null: asked for, and not reached or not known."""

    fields: "tuple[Field, ...]" = ()

    since: int = 1
    """Version of the format from which on a tick has it."""

    default: float | None = None
    """Of a tick that does not say, or is older than the field; None where every tick must."""


@dataclass(frozen=True)
class Channel:
    """One stream of messages."""

    topic: str
    encoding: str
    """`cdr` (binary, one message a tick) or `json`."""

    rate: str
    meaning: str
    fields: tuple[Field, ...]

    @property
    def schema_name(self) -> str:
        """Name of the message type in the file."""
        return f"exograv/msg/{self.topic.strip('/').title().replace('_', '')}"


T = Field("t", "number", "s", "time on the rig's clock")
JOINT: Size = ("joint",)
LIST: Size = ("any",)
POINTS: Size = ("any", 3)

PARAMETER_FIELDS = (
    Field("name", "string", "-", "parameter of the arm"),
    Field("unit", "string", "-", "unit of the values beside it"),
    Field("prior", "number", "unit", "value by the anthropometric table"),
    Field("estimate", "number", "unit", "value in force"),
    Field("ci95", "number", "unit", "lower and upper end of the 95 % interval", (2,), nullable=True),
)
CALIBRATION_FIELDS = (
    Field("joint", "string", "-", "joint"),
    Field("name", "string", "-", "what was measured: `gain`, `coulomb`, `viscous`"),
    Field("unit", "string", "-", "unit of the values beside it"),
    Field("truth", "number", "unit", "value of the twin", optional=True, nullable=True),
    Field("estimate", "number", "unit", "value found on the empty machine"),
    Field("ci95", "number", "unit", "lower and upper end of the 95 % interval", (2,), optional=True, nullable=True),
)

TICK = Channel(
    "/tick",
    "cdr",
    "every tick, 1 kHz",
    "What was measured, wanted and commanded in one period.",
    (
        Field("t", "float64", "s", "time of the measurement on the rig's clock"),
        Field("phase", "uint32", "-", "number of `/phase` messages so far; 0 before the first"),
        Field(
            "closure_slope",
            "float32",
            "N·m",
            "largest slope of the cuffs' energy left; above 1e-6 the loops are not closed",
        ),
        Field("tick_us", "float32", "µs", "time that the controller took; no seed fixes it"),
        Field(
            "lateness_us",
            "float32",
            "µs",
            "how late the period began; NaN on a virtual clock, no seed fixes it",
            since=2,
            default=math.nan,
        ),
        Field(
            "safe_state",
            "uint32",
            "-",
            "0: control's own torque, limited; one more than the number of the safe state (SS0 to SS3) otherwise",
            since=2,
            default=0.0,
        ),
        Field(
            "sequence",
            "uint32",
            "-",
            "number of the measurement; a gap is a tick that was lost; 0 throughout where nobody counted",
            since=2,
            default=0.0,
        ),
        Field("q_measured", "float32", "rad", "joint position by the encoder", JOINT),
        Field("q_reference", "float32", "rad", "joint position wanted; NaN while nothing is wanted", JOINT),
        Field("v", "float32", "rad/s", "joint velocity as the controller used it", JOINT),
        Field("current", "float32", "A", "motor current; NaN where torque comes from a sensor", JOINT),
        Field("tau_measured", "float32", "N·m", "joint torque by current and calibration, or by the sensor", JOINT),
        Field("tau_feedforward", "float32", "N·m", "joint torque that the model expects, friction included", JOINT),
        Field("tau_desired", "float32", "N·m", "joint torque that control asked for", JOINT),
        Field(
            "tau_commanded",
            "float32",
            "N·m",
            "joint torque that the motors were told; other than desired where the envelope stepped in",
            JOINT,
        ),
    ),
)

SETTINGS = Channel(
    "/settings",
    "json",
    "once, first",
    "Everything that the run was started with.",
    (
        Field("schema_version", "integer", "-", "version of this format"),
        Field("joints", "string", "-", "actuated joints, in the order of every per-joint list", LIST),
        Field("rig", "string", "-", "name of the machine", optional=True),
        Field("title", "string", "-", "the machine in words", optional=True),
        Field("side", "string", "-", "`right` or `left` arm", optional=True),
        Field("command", "string", "-", "command that made the recording", optional=True),
        Field("method", "string", "-", "identification method", optional=True),
        Field("torque_source", "string", "-", "where measured torque comes from", optional=True),
        Field("disturbance_level", "integer", "-", "level of the twin, 0–4", optional=True),
        Field("seed", "integer", "-", "seed of the run", optional=True),
        Field("gravity_level", "number", "-", "felt share of the arm's own weight", optional=True),
        Field("wearer", "object", "-", "what the software was told: height_m, mass_kg, sex …", optional=True),
        Field("targets_Nm", "number", "N·m", "largest left over that counts as weightless", JOINT, optional=True),
        Field("limits", "object", "-", "limits of the envelope, unit in each name", optional=True),
        Field("hashes", "object", "-", "SHA-256 of rig and settings files", optional=True),
        Field("versions", "object", "-", "versions of exograv and of the packages that count", optional=True),
        Field("settings", "object", "-", "settings of all rooms, unchanged", optional=True),
    ),
)

PHASE = Channel(
    "/phase",
    "json",
    "at each change",
    "What the session is doing from here on.",
    (T, Field("name", "string", "-", "`calibrate`, `table`, `identify`, `held_out`, `float`, `weigh` …")),
)

EVENT = Channel(
    "/event",
    "json",
    "when it happens",
    "Something an operator should know; on disk at once.",
    (
        T,
        Field("kind", "string", "-", "`note`, `warning`, `stop`, `near singular`, `not relaxed` …"),
        Field("text", "string", "-", "a sentence"),
    ),
)

ESTIMATE = Channel(
    "/estimate",
    "json",
    "about 5 Hz while identifying",
    "The arm as far as it is known.",
    (
        T,
        Field("motion_s", "number", "s", "seconds of motion since the first sample of the identification"),
        Field("parameters", "object", "-", "one entry a parameter", LIST, fields=PARAMETER_FIELDS),
        Field(
            "predicted_left_over_Nm",
            "number",
            "N·m",
            "left over that the estimator itself expects (one standard deviation)",
            JOINT,
            optional=True,
            nullable=True,
        ),
        Field("outcome", "string", "-", "the estimator's sentence for the operator"),
    ),
)

LEFT_OVER = Channel(
    "/left_over",
    "json",
    "some times a minute, twin only",
    "What is truly left over at the held-out postures, by the twin's examiner; never shown to the estimator.",
    (
        T,
        Field("motion_s", "number", "s", "seconds of motion since the first sample of the identification"),
        Field("total", "number", "N·m", "exoskeleton and arm, RMS over the held-out postures", JOINT),
        Field("arm", "number", "N·m", "arm alone, RMS over the held-out postures", JOINT, optional=True),
    ),
)

SKELETON = Channel(
    "/skeleton",
    "json",
    "about 20 Hz",
    "Points to draw, in the base frame (x forward, y left, z up).",
    (
        T,
        Field("exo", "number", "m", "line along the exoskeleton, base to tip", POINTS),
        Field("arm", "number", "m", "line along the wearer's arm, shoulder to hand", POINTS),
    ),
)

RESULT = Channel(
    "/result",
    "json",
    "once, last",
    "The figures of the run: the command's JSON without wall-clock times and paths.",
    (
        T,
        Field(
            "left_over_rms_Nm", "object", "N·m", "`total` and `arm`, each by name of a stage, per joint", optional=True
        ),
        Field("identification", "object", "-", "how the identification ended, when, and why", optional=True),
        Field(
            "identifiability",
            "object",
            "-",
            "base parameters, condition number, what the data and what the prior decided",
            optional=True,
            nullable=True,
        ),
        Field(
            "possible_left_over_Nm",
            "object",
            "N·m",
            "`median` and `p95` per joint, by the estimate's own uncertainty",
            optional=True,
            nullable=True,
        ),
        Field("parameters", "object", "-", "name, unit, truth, prior, estimate, ci95", LIST, optional=True),
        Field("known_weight", "object", "kg", "true_kg, estimated_kg, ci95_kg", optional=True),
        Field("float", "object", "-", "gravity_level, drift_deg per joint, window_s", optional=True),
        Field("calibration", "object", "-", "empty machine", LIST, optional=True, fields=CALIBRATION_FIELDS),
        Field("calibration_used", "object", "-", "stored (hash, measured_utc, warning) or of this run", optional=True),
        Field("simulated_s", "number", "s", "simulated time", optional=True),
        Field("rig", "string", "-", "name of the machine", optional=True),
        Field("method", "string", "-", "identification method", optional=True),
        Field("motion", "string", "-", "what moved the arm while it was identified", optional=True),
        Field("disturbance_level", "integer", "-", "level of the twin, 0–4", optional=True),
        Field("seed", "integer", "-", "seed of the run", optional=True),
        Field("joints", "string", "-", "actuated joints", LIST, optional=True),
    ),
)

TIMING = Channel(
    "/timing",
    "json",
    "once, last, live runs only",
    "How punctual the run was, by which rights, and what its recorder went through.",
    (
        T,
        Field("periods", "integer", "-", "periods that passed, with a tick or without"),
        Field("missed", "integer", "-", "periods that ended without their own command"),
        Field(
            "edges_us", "number", "µs", "bins of lateness, one edge more than counts; the last takes all above", LIST
        ),
        Field("counts", "integer", "-", "ticks by lateness", LIST),
        Field("longest_gap_us", "number", "µs", "longest time between a command and the next", optional=True),
        Field("granted", "string", "-", "real-time rights that the system granted", LIST),
        Field("refused", "string", "-", "those it refused, and what to do", LIST),
        Field("ticks_lost", "integer", "-", "ticks that found the recorder's ring full", optional=True),
        Field("recorder_restarts", "integer", "-", "times that the recorder had to be started again", optional=True),
    ),
)

CHANNELS = {
    channel.topic: channel for channel in (SETTINGS, TICK, PHASE, EVENT, ESTIMATE, LEFT_OVER, SKELETON, RESULT, TIMING)
}
