"""Record that the tick in C and its caller in Python share.

    python -m exograv.loop.native.record

The command writes `record.h` from this class. A test fails where they differ.
"""

import ctypes
from pathlib import Path

from exograv.recording.tick_row import JOINT_FIELDS, SCALARS
from exograv.safety.native import core
from exograv.safety.native.structs import header

HEADER = Path(__file__).with_name("record.h")

ARMS, RAMPS = 2, 2
"""Places for the muscles of arms, and for parameters that fade in."""

FINISHED, NOT_FINITE, DIVERGED = range(3)
"""Results of a tick: finished; a current is not finite, and the machine has not moved; the simulation has diverged."""


class Ramp(ctypes.Structure):
    """Parameters that fade in, as in `control.handover`."""

    _fields_ = (
        ("size", ctypes.c_int64),
        ("start", ctypes.c_void_p),
        ("goal", ctypes.c_void_p),
        ("x", ctypes.c_void_p),
        ("counts", ctypes.c_void_p),
        ("written", ctypes.c_void_p),
    )


class Arm(ctypes.Structure):
    """Muscle torques of one arm."""

    _fields_ = (("freedoms", ctypes.c_int64), ("torques", ctypes.c_void_p), ("now", ctypes.c_void_p))


class Pole(ctypes.Structure):
    """Pole of a shoulder's angles, as in `rig.twin.world.poles`."""

    _fields_ = (
        *((name, ctypes.c_void_p) for name in ("abduction", "inertia", "engine_damping", "velocity", "forces")),
        ("is_near", ctypes.c_void_p),
        ("places", ctypes.c_int64 * 3),
        ("turning", ctypes.c_int64 * 2),
        ("damping", ctypes.c_double * 2),
        *((name, ctypes.c_double) for name in ("damping_step", "stable_share", "far_cosine")),
    )


_COUNTS = ("joints", "substeps", "velocities", "arms", "ramps", "poles", "has_motor")
_MACHINE = (
    *("sensors", "sensors_memory", "noise", "noise_now", "q", "current", "q_motor"),
    *("forces", "forces_memory", "first_half", "second_half", "model", "data", "velocity"),
    *("current_in", "damping_in", "valid_until_in"),
)
_GUARD = ("see", "decide", "guard", "table")
_CONTROL = (
    *("observer", "observer_memory", "q_measured", "q_observed", "v_observed"),
    *("law", "law_memory", "law_q", "law_v", "law_q_reference", "law_v_reference", "law_a_reference"),
    *("mode", "tau_desired", "tau_feedforward", "slope", "gain"),
)
_PATH = ("q_path", "v_path", "a_path")
_RESULTS = ("tau_measured", "tau_commanded", "row")
_OF_TICK = ("tick", "sequence", "noise_row", "muscle_row", "is_usable")
_NUMBERS = ("t", "command_life", "drive", "gravity_level", "arm_share", "control", "acts", "phase", "tick_us")


class LockStep(ctypes.Structure):
    """Memory of everything that takes part in a tick, then the values of this tick."""

    _fields_ = (
        *((name, ctypes.c_int64) for name in _COUNTS),
        *((name, ctypes.c_void_p) for name in (*_MACHINE, *_GUARD, *_CONTROL, *_PATH, *_RESULTS)),
        ("arm", Arm * ARMS),
        ("pole", Pole * ARMS),
        ("ramp", Ramp * RAMPS),
        *((name, ctypes.c_int64) for name in _OF_TICK),
        *((name, ctypes.c_double) for name in _NUMBERS),
    )


_PLACES = ("CAME", "SEQUENCE_IN", "T_IN", "NOW", "IN_CURRENT", "HAS_MOTOR", "SPOKE", "ANSWERS", "VALID_UNTIL")
_FIELDS = ("Q_IN", "CURRENT_IN", "TAU_IN", "Q_MOTOR_IN", "ANSWER_IN", "TAU", "ISOLATED", "POWERLESS", "DAMPING")
_STATE = ("STOP", "USABLE", "SAFE_STATE", "WITHOUT_MODEL_SHARE")
CONSTANTS: dict[str, float | int] = {
    "ARMS": ARMS,
    "RAMPS": RAMPS,
    "FINISHED": FINISHED,
    "NOT_FINITE": NOT_FINITE,
    "DIVERGED": DIVERGED,
    **{f"GUARD_{name}": getattr(core, name) for name in (*_PLACES, *_FIELDS, *_STATE)},
    **{f"ROW_{name.upper()}": place for place, name in enumerate((*SCALARS, "phase"))},
    "ROW_SCALARS": len(SCALARS) + 1,
    **{f"ROW_FIELD_{name.upper()}": place for place, name in enumerate(JOINT_FIELDS)},
}
"""Places of the guard's record, and places of a row of the recording: scalars, then fields with a value per joint."""


def write_header() -> None:
    """Write the C header of the record."""
    HEADER.write_text(text())


def text() -> str:
    """Return the C header of the record."""
    return header((Ramp, Arm, Pole, LockStep), CONSTANTS)


if __name__ == "__main__":
    write_header()
