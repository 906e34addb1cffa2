"""Table of the recording format; writer, reader and docs/recording_format.md are made from it."""

from .fields import JOINT, LIST, POINTS, Channel, Field, T, fields_of
from .messages import ClockCorrection, StreamNote, TimingMessage
from .task_channels import AIRCRAFT, TASK
from .tick_fields import TICK as TICK

SCHEMA_VERSION = 4
"""Version of the format, raised when an old reader would misread a new file; all versions from 1 on are read."""

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
        Field("task", "object", "-", "windows, touches and deviations of a session", optional=True),
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
        *fields_of(TimingMessage),
    ),
)

CONTROL = Channel(
    "/control",
    "json",
    "at each change",
    "What control was given: all that `exograv replay` needs beside the ticks. Numbers are exact.",
    (
        T,
        Field(
            "act",
            "string",
            "-",
            "`pilot` (a machine and its guard begin), `fly` (a controller takes over), `publish`, `force`, `carry`, "
            "`hang`, `lead` (what a controller is told), `wear` (who the guard takes to be in the machine), `level` "
            "(what that person is to feel)",
        ),
        Field("controller", "integer", "-", "which one, from 0, of the pilot in charge", optional=True),
        Field(
            "kind",
            "string",
            "-",
            "of a controller that is new: `empty` (machine alone), `arm`, `other` (its torque cannot be replayed)",
            optional=True,
        ),
        Field("period_s", "number", "s", "of a pilot: between two ticks", optional=True),
        Field("actuators", "object", "N·m/A", "of a pilot: `gain` and `gain_sd` per joint", optional=True),
        Field("machine", "object", "SI", "of an arm's controller: the machine as calibrated", optional=True),
        Field("x", "number", "SI", "parameters of the arm that are told", LIST, optional=True),
        Field("q", "number", "rad", "posture in which they must not be felt as a push", JOINT, optional=True),
        Field("place", "string", "-", "of a known weight: `hand`, `forearm`, or a mount", optional=True),
        Field("mass_kg", "number", "kg", "the known weight that is carried from now on", optional=True),
        Field("side", "string", "-", "of two arms, the one that leads the other; null: none", optional=True),
        Field("person", "object", "SI", "limits of who is in the machine", optional=True),
        Field("gravity_level", "number", "-", "share of the arm's weight that is to be felt", optional=True),
        Field("ramp_s", "number", "s", "in which it comes, at least", optional=True),
        Field("is_driven", "boolean", "-", "whether that person is moved along a path", optional=True),
        Field("taken", "boolean", "-", "whether the controller accepted it", optional=True),
    ),
)

STREAM = Channel(
    "/stream",
    "json",
    "when it happens, runs with other devices only",
    "What became of a stream of another device; its samples are in a channel of its own.",
    (
        T,
        *fields_of(StreamNote),
    ),
)

CORRECTION = Channel(
    "/correction",
    "json",
    "every 2 s and stream, runs with other devices only",
    "LSL's estimate of what a stream's clock lacks: one `time_correction()`, as it came.",
    (
        T,
        *fields_of(ClockCorrection),
    ),
)

PAGE = Channel(
    "/page",
    "json",
    "when it happens, runs that are steered from pages only",
    "What was asked for at a page, and what a page told.",
    (
        T,
        Field(
            "topic",
            "string",
            "-",
            "`/act`: what was asked for, `by` whose page, if it was `taken`, and `why` not; others are the console's",
        ),
        Field("message", "object", "-", "what it holds"),
    ),
)

CHANNELS = {
    channel.topic: channel
    for channel in (
        SETTINGS,
        TICK,
        PHASE,
        EVENT,
        ESTIMATE,
        LEFT_OVER,
        SKELETON,
        RESULT,
        TIMING,
        CONTROL,
        STREAM,
        CORRECTION,
        PAGE,
        TASK,
        AIRCRAFT,
    )
}
