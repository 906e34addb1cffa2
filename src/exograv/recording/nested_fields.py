"""Contents of the objects in `/settings`, `/control` and `/result` that reports, views and replays read."""

from collections.abc import Sequence

from .fields import EACH, JOINT, LIST, Field, Size


def _numbers(*names: str, size: Size = (), optional: bool = True) -> tuple[Field, ...]:
    return tuple(Field(name, "number", "SI", "", size, optional) for name in names)


def _texts(*names: str) -> tuple[Field, ...]:
    return tuple(Field(name, "string", "-", "", optional=True) for name in names)


def _integers(*names: str) -> tuple[Field, ...]:
    return tuple(Field(name, "integer", "-", "", optional=True) for name in names)


def _object(name: str, known: Sequence[Field], size: Size = (), *, optional: bool = True) -> Field:
    return Field(name, "object", "-", "", size, optional, known=tuple(known))


EACH_TEXT = _texts(EACH)
EACH_NUMBER = _numbers(EACH)

LENGTHS = _object("lengths_m", EACH_NUMBER)
WEARER = (*_numbers("height_m", "mass_kg"), *_texts("sex"), LENGTHS)
"""Body data of a person, rounded for the reader."""

BODY = (*_numbers("height_m", "mass_kg", optional=False), Field("sex", "string", "-", ""), LENGTHS)

ACTUATORS = _numbers("gain", "gain_sd", size=JOINT, optional=False)
FRICTION = (*_numbers("v_rest", optional=False), *_numbers(EACH, size=JOINT))
MACHINE = (
    _object("actuators", ACTUATORS, optional=False),
    _object("friction", FRICTION, optional=False),
    _object("friction_sd", FRICTION, optional=False),
    *_numbers("phi", size=("joint", 10), optional=False),
    *_numbers("gravity", size=(3,), optional=False),
    *_numbers("rotor_inertia", "residual_sd", "correlation_s", size=JOINT, optional=False),
)
"""Fields of a calibrated machine."""

PATH = (
    Field("kind", "string", "-", "", optional=True),
    *_numbers("q_start", "q_goal", "low", "high", size=JOINT),
    *_integers("ticks", "rest_ticks", "count"),
    *_numbers("period_s", "ease_s", "dt"),
)
"""Fields of a path that a procedure orders: a passage or cycles (`motion.py`)."""

LIMB = (
    Field("joints", "integer", "-", "", LIST),
    Field("most_factors", "integer", "-", ""),
    *_numbers("exo", "arm", size=("any", "any"), optional=False),
)
TABLE = (
    _object("chains", LIMB, LIST, optional=False),
    *_numbers("error", "dry", "viscous", size=JOINT, optional=False),
)
PERSON = (
    _object("table", TABLE, optional=False),
    *_numbers("active_max_Nm", "q_lower", "q_upper", size=JOINT, optional=False),
    *EACH_NUMBER,
)
"""Fields of the guard's limits of a person."""

VERIFICATION = (*_numbers("postures", size=("any", "joint"), optional=False), Field("seed", "integer", "-", ""))
LIVE = (
    Field("period_s", "number", "s", "", is_positive=True),
    _object("machine", MACHINE, optional=False),
    *_numbers("x", size=LIST, optional=False),
    _object("person", PERSON, optional=False),
    *_numbers("identify_s"),
    _object("verification", VERIFICATION),
    Field("is_steered", "boolean", "-", "", optional=True),
    Field("publishes_later", "boolean", "-", "", optional=True),
)
"""Fields of the start values of guard and control in a live run."""

TOLD = (_object("body", BODY, optional=False), _object("lengths_m", EACH_NUMBER, optional=False))
OPTIONS = (*_texts("rig", "participant"), *_integers("session", "windows"))
RUN = (
    *_texts("run", "launch", "participant", "protocol", "protocol_sha256"), *_integers("session"),
    Field("complete", "integer", "-", "", LIST, optional=True),
)  # fmt: skip
ROOMS = (
    _object("rig_files", EACH_TEXT), _object("told", TOLD), _object("options", OPTIONS), _object("live", LIVE),
    _object("run", RUN), _object("joined", (*_integers("recordings"), Field("remarks", "string", "-", "", LIST))),
)  # fmt: skip
"""Settings of all rooms, as far as another room than the writer reads them."""

PER_JOINT = (Field(EACH, "number", "N·m", "", JOINT, optional=True, holes=True),)
LEFT_OVER = (_object("total", PER_JOINT), _object("arm", PER_JOINT))
IDENTIFICATION = (*_texts("outcome"), *_numbers("time_to_target_s", "motion_s"))
COMPARISON = (
    *_texts("text", "date"), *_numbers("others_Nm", size=("any", "joint")), *_integers("reached"),
    Field("lower", "integer", "-", "", JOINT, optional=True),
)  # fmt: skip
KNOWN_WEIGHT = (*_numbers("true_kg", "estimated_kg"), *_numbers("ci95_kg", size=(2,)))
FLOATED = (*_numbers("gravity_level", "window_s"), *_numbers("drift_deg", size=JOINT))
PARAMETER = (
    Field("name", "string", "-", ""),
    *_texts("unit"),
    *_numbers("truth", "prior", "estimate"),
    *_numbers("ci95", size=(2,)),
)
CALIBRATION_USED = _texts("hash", "measured_utc", "warning")
TASK = (*_integers("windows", "accepted", "touches"), _object("deviation_px", _numbers("median")))
