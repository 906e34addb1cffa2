"""Table of the recording format; writer, reader and the page of channels in the documentation are made from it."""

from . import nested_fields as inside
from .fields import JOINT, LIST, POINTS, Channel, Field, T, fields_of
from .messages import ClockCorrection, StreamNote, TimingMessage
from .task_channels import AIRCRAFT, TASK
from .tick_fields import TICK as TICK

SCHEMA_VERSION = 4
"""Version of the format, raised when an old reader would misread a new file; all versions from 1 on are read."""

PACKED_VERSION = 5
"""Version of a recording whose ticks are packed by column (`tick_columns`); its messages are those of version 4."""

PARAMETER_FIELDS = (
    Field("name", "string", "-", "parameter of the arm"),
    Field("unit", "string", "-", "unit of the values beside it"),
    Field("prior", "number", "unit", "value by the anthropometric table"),
    Field("estimate", "number", "unit", "value in force"),
    Field("ci95", "number", "unit", "lower and upper end of the 95 % interval", (2,), nullable=True),
)
CALIBRATION_FIELDS = (
    Field("joint", "string", "-", "joint"),
    Field("name", "string", "-", "measured quantity: `gain`, `coulomb`, `viscous`"),
    Field("unit", "string", "-", "unit of the values beside it"),
    Field("truth", "number", "unit", "value of the twin", optional=True, nullable=True),
    Field("estimate", "number", "unit", "value found on the empty machine"),
    Field("ci95", "number", "unit", "lower and upper end of the 95 % interval", (2,), optional=True, nullable=True),
)

SETTINGS = Channel(
    "/settings",
    "json",
    "once, first",
    "Settings with which the run was started.",
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
        Field("world", "string", "-", "laws of the twin: `home`, or a foreign world", optional=True),
        Field("seed", "integer", "-", "seed of the run", optional=True),
        Field("gravity_level", "number", "-", "felt share of the arm's own weight", optional=True),
        Field(
            "wearer",
            "object",
            "-",
            "data of the wearer as entered: height_m, mass_kg, sex …",
            optional=True,
            known=inside.WEARER,
        ),
        Field(
            "targets_Nm",
            "number",
            "N·m",
            "largest left over (RMS residual gravity torque) that counts as weightless",
            JOINT,
            optional=True,
        ),
        Field("limits", "object", "-", "limits of the envelope, unit in each name", optional=True),
        Field("hashes", "object", "-", "SHA-256 of rig and settings files", optional=True, known=inside.EACH_TEXT),
        Field(
            "versions",
            "object",
            "-",
            "versions of exograv and of the packages that affect results",
            optional=True,
            known=inside.EACH_TEXT,
        ),
        Field("settings", "object", "-", "settings of all rooms, unchanged", optional=True, known=inside.ROOMS),
    ),
)

PHASE = Channel(
    "/phase",
    "json",
    "at each change",
    "Phase of the session that begins here.",
    (T, Field("name", "string", "-", "`calibrate`, `table`, `identify`, `held_out`, `float`, `weigh` …")),
)

REST_PASSED = "rest passed"
"""Kind of the event before a rest of which a simulation has no ticks: the machine's clock jumps ahead there."""

EVENT = Channel(
    "/event",
    "json",
    "when it happens",
    "Event for the operator; written to disk at once.",
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
    "Present estimate of the arm.",
    (
        T,
        Field("motion_s", "number", "s", "seconds of motion since the first sample of the identification"),
        Field("parameters", "object", "-", "one entry per parameter", LIST, fields=PARAMETER_FIELDS),
        Field(
            "predicted_left_over_Nm",
            "number",
            "N·m",
            "left over that the estimator itself expects (one standard deviation)",
            JOINT,
            optional=True,
            nullable=True,
            holes=True,
        ),
        Field("outcome", "string", "-", "the estimator's sentence for the operator"),
    ),
)

LEFT_OVER = Channel(
    "/left_over",
    "json",
    "several times per minute, twin only",
    "True left over at the held-out postures, by the twin's examiner; the estimator has no access to it.",
    (
        T,
        Field("motion_s", "number", "s", "seconds of motion since the first sample of the identification"),
        Field("total", "number", "N·m", "exoskeleton and arm, RMS over the held-out postures", JOINT, holes=True),
        Field("arm", "number", "N·m", "arm alone, RMS over the held-out postures", JOINT, optional=True, holes=True),
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
    "Figures of the run: the command's JSON without wall-clock times and paths.",
    (
        T,
        Field(
            "left_over_rms_Nm",
            "object",
            "N·m",
            "`total` and `arm`, each by name of a stage, per joint",
            optional=True,
            known=inside.LEFT_OVER,
        ),
        Field(
            "identification",
            "object",
            "-",
            "how the identification ended, when, and why",
            optional=True,
            known=inside.IDENTIFICATION,
        ),
        Field(
            "identifiability",
            "object",
            "-",
            "base parameters, condition number, and which of them the data or the prior determined",
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
        Field(
            "parameters",
            "object",
            "-",
            "name, unit, truth, prior, estimate, ci95",
            LIST,
            optional=True,
            known=inside.PARAMETER,
        ),
        Field(
            "comparison",
            "object",
            "-",
            "place among other simulated wearers by true left over: text, others_Nm, lower, reached, date",
            optional=True,
            known=inside.COMPARISON,
        ),
        Field(
            "known_weight",
            "object",
            "kg",
            "true_kg, estimated_kg, ci95_kg",
            optional=True,
            known=inside.KNOWN_WEIGHT,
        ),
        Field(
            "float", "object", "-", "gravity_level, drift_deg per joint, window_s", optional=True, known=inside.FLOATED
        ),
        Field("calibration", "object", "-", "empty machine", LIST, optional=True, fields=CALIBRATION_FIELDS),
        Field(
            "calibration_used",
            "object",
            "-",
            "stored (hash, measured_utc, warning) or of this run",
            optional=True,
            known=inside.CALIBRATION_USED,
        ),
        Field("task", "object", "-", "windows, touches and deviations of a session", optional=True, known=inside.TASK),
        Field("simulated_s", "number", "s", "simulated time", optional=True),
        Field("rig", "string", "-", "name of the machine", optional=True),
        Field("method", "string", "-", "identification method", optional=True),
        Field("motion", "string", "-", "source of the motion during identification", optional=True),
        Field("disturbance_level", "integer", "-", "level of the twin, 0–4", optional=True),
        Field("world", "string", "-", "laws of the twin: `home`, or a foreign world", optional=True),
        Field("seed", "integer", "-", "seed of the run", optional=True),
        Field("joints", "string", "-", "actuated joints", LIST, optional=True),
    ),
)

TIMING = Channel(
    "/timing",
    "json",
    "once, last, live runs only",
    "Punctuality of the run, its real-time rights, and losses and restarts of its recorder.",
    (
        T,
        *fields_of(TimingMessage),
    ),
)

CONTROL = Channel(
    "/control",
    "json",
    "at each change",
    "Inputs of control that `exograv data replay` needs beside the ticks. Numbers are exact.",
    (
        T,
        Field(
            "act",
            "string",
            "-",
            "`pilot` (a machine and its guard begin), `fly` (a controller takes over), `prepare`, `publish`, `force`, "
            "`carry`, `hang`, `lead` (inputs of a controller), `wear` (limits of the person in the machine), `level` "
            "(gravity level that the person is to feel), `order` (of a procedure that moves the arm in a live run)",
        ),
        Field("controller", "integer", "-", "number of the controller, from 0, of the present pilot", optional=True),
        Field(
            "kind",
            "string",
            "-",
            "of a new controller: `empty` (machine alone), `arm`, `other` (its torque cannot be replayed)",
            optional=True,
        ),
        Field("period_s", "number", "s", "of a pilot: time between two ticks", optional=True, is_positive=True),
        Field(
            "actuators",
            "object",
            "N·m/A",
            "of a pilot: `gain` and `gain_sd` per joint",
            optional=True,
            known=inside.ACTUATORS,
        ),
        Field(
            "machine",
            "object",
            "SI",
            "of an arm's controller: the machine as calibrated",
            optional=True,
            known=inside.MACHINE,
        ),
        Field("x", "number", "SI", "parameters of the arm that the controller gets", LIST, optional=True),
        Field("slid_m", "number", "m", "way of each cuff along the limb since it was fastened", LIST, optional=True),
        Field(
            "q",
            "number",
            "rad",
            "posture in which a change of the parameters must not be felt as a push; of `prepare`, the posture "
            "for which control prepared before the first tick",
            JOINT,
            optional=True,
        ),
        Field("place", "string", "-", "of a known weight: `hand`, `forearm`, or a mount", optional=True),
        Field("mass_kg", "number", "kg", "known weight that is carried from now on", optional=True),
        Field("side", "string", "-", "of two arms, the one whose motion the other follows; null: none", optional=True),
        Field("person", "object", "SI", "limits of the person in the machine", optional=True, known=inside.PERSON),
        Field("gravity_level", "number", "-", "share of the arm's weight that is to be felt", optional=True),
        Field("ramp_s", "number", "s", "shortest duration of the ramp", optional=True),
        Field("is_driven", "boolean", "-", "true if the person is moved along a path", optional=True),
        Field("taken", "boolean", "-", "true if the controller accepted the input", optional=True),
        Field("number", "integer", "-", "number of an order, from 1", optional=True),
        Field("is_led", "boolean", "-", "of an order: true if the arm is held or moved, not floating", optional=True),
        Field("path", "object", "SI", "of an order: path of the arm; null: it stays", optional=True, known=inside.PATH),
        Field("guide", "string", "-", "of an order: `anchor`, `path`, `taught`; null: no guide", optional=True),
        Field("speed", "number", "-", "of an order: share of the speed of a guide's path", optional=True),
        Field("grip", "number", "-", "of an order: share of the pull with which a guide begins", optional=True),
        Field("lets_go", "boolean", "-", "of an order: true if the guide releases the arm", optional=True),
        Field("is_load_known", "boolean", "-", "of an order: false with an unknown weight", optional=True),
    ),
)

GUARD = Channel(
    "/guard",
    "json",
    "every 2 s",
    "State of the guard after a tick. A replay compares it, and continues with it after a gap.",
    (
        T,
        Field("now", "number", "s", "`now` of the tick"),
        Field("persons", "integer", "-", "persons that the guard has been given since the begin of a live run"),
        Field("version", "string", "-", "version of the guard: CRC-32 of its source, hexadecimal"),
        Field("state", "string", "-", "float64, little-endian, packed by zlib, in base 64 (`safety/state.py`)"),
    ),
)

STREAM = Channel(
    "/stream",
    "json",
    "when it happens, runs with other devices only",
    "Event of another device's stream; its samples are in their own channel.",
    (
        T,
        *fields_of(StreamNote),
    ),
)

CORRECTION = Channel(
    "/correction",
    "json",
    "every 2 s per stream, runs with other devices only",
    "LSL's correction of a stream's clock: one unchanged result of `time_correction()`.",
    (
        T,
        *fields_of(ClockCorrection),
    ),
)

PAGE = Channel(
    "/page",
    "json",
    "when it happens, only in runs that are steered from pages",
    "Requests and reports of a page.",
    (
        T,
        Field(
            "topic",
            "string",
            "-",
            "`/act`: request, `by` which page, if it was `taken`, and `why` not; others are the console's",
        ),
        Field("message", "object", "-", "content of the message"),
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
        GUARD,
        STREAM,
        CORRECTION,
        PAGE,
        TASK,
        AIRCRAFT,
    )
}
