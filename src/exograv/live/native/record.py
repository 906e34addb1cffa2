"""Record that the loop in C and its supervisor in Python share.

    python -m exograv.live.native.record

The command writes `record.h` from these classes. A test fails where they differ.
"""

import ctypes
import enum
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from exograv.recording.encoding import tick_dtype
from exograv.runtime.control_loop.exchange import (
    CONSENTED,
    DRIFTED,
    STOP_PRESSED,
    TOLD_LEVEL,
    TOLD_PERSON,
    answer_dtype,
    state_dtype,
)
from exograv.runtime.processes.shared_memory import SLOTS
from exograv.runtime.recorder.recorder_process import guard_dtype
from exograv.safety.guard import CONSENT_S, GRAVITY_LEVEL_MAX, SafeState
from exograv.safety.native import core
from exograv.safety.native.structs import header

HEADER = Path(__file__).with_name("record.h")

ORDERS, HAPPENINGS = 16, 256
"""Places for orders that the loop has not taken yet, and for happenings that the supervisor has not read yet."""


class Order(enum.IntEnum):
    """Order of the supervisor; the loop takes one after each tick."""

    NONE = 0
    FEEL = 1
    """Lead the felt gravity level to `numbers[0]`, by a ramp of at least `numbers[1]` seconds."""
    WEAR = 2
    """Take the limits of a person from `record`, with the table `table`."""
    TRIP = 3
    """Let the arm down for the reason with the number `numbers[0]`, which the drift monitor found."""
    CONSENT = 4
    """Take the wearer's consent to levels above 1."""


class Happening(enum.IntEnum):
    """Happening in a tick, with a value for the supervisor."""

    NONE = 0
    MODE = 1
    """Control has entered the mode with the number `value`."""
    STOP = 2
    """The guard has stopped for the reason with the number `value`."""
    FELT = 3
    """The ramp to the level `value` has begun."""
    REFUSED = 4
    """The ramp to the level `value` was refused."""
    WORN = 5
    """The guard knows the person as identified."""
    ALONE = 6
    """The supervisor has been silent for too long, and the loop lets the arm down."""
    AGREED = 7
    """The wearer's consent was taken if `value` is 1, and refused if it is 0."""


class Outcome(enum.IntEnum):
    """End of the loop."""

    RUNNING = 0
    COMPLETE = 1
    ENDED_EARLY = 2
    NO_REST = 3


class OrderPlace(ctypes.Structure):
    """Order of the supervisor."""

    _fields_ = [
        ("kind", ctypes.c_int64),
        ("numbers", ctypes.c_double * 2),
        ("record", ctypes.c_void_p),
        ("table", ctypes.c_void_p),
    ]


class HappeningPlace(ctypes.Structure):
    """Happening in a tick."""

    _fields_ = [
        ("kind", ctypes.c_int64),
        ("value", ctypes.c_double),
        ("now", ctypes.c_double),
        ("at_ns", ctypes.c_int64),
        ("period", ctypes.c_int64),
    ]


class MailboxPlace(ctypes.Structure):
    """Mailbox or ring in shared memory, as `runtime.processes.shared_memory` lays it out."""

    _fields_ = [
        ("head", ctypes.c_void_p),
        ("rows", ctypes.c_void_p),
        ("stride", ctypes.c_int64),
        ("count", ctypes.c_int64),
        ("value_at", ctypes.c_int64),
        ("value_bytes", ctypes.c_int64),
        ("done_at", ctypes.c_int64),
    ]


def _places(name: str, dtype: np.dtype) -> type[ctypes.Structure]:
    """Return a struct with the offset of each field of a type."""
    fields = [(field, ctypes.c_int64) for field in dtype.names or () if field != "cdr_header"]
    return type(name, (ctypes.Structure,), {"_fields_": fields, "__doc__": f"Offsets of the fields of {name} [byte]."})


StatePlaces = _places("StatePlaces", state_dtype(1))
AnswerPlaces = _places("AnswerPlaces", answer_dtype(1))
TickPlaces = _places("TickPlaces", tick_dtype(1))
GuardPlaces = _places("GuardPlaces", guard_dtype(1))


class LiveLoop(ctypes.Structure):
    """Loop in C. While it runs, the supervisor changes it only through C functions."""

    _fields_ = [
        # Settings.
        ("drives", ctypes.c_void_p),
        ("read_drives", ctypes.c_void_p),
        ("write_drives", ctypes.c_void_p),
        ("guard", ctypes.c_void_p),
        ("table", ctypes.c_void_p),
        ("guard_see", ctypes.c_void_p),
        ("guard_decide", ctypes.c_void_p),
        ("guard_trip", ctypes.c_void_p),
        ("guard_begin_torque", ctypes.c_void_p),
        ("states", MailboxPlace),
        ("answers", MailboxPlace),
        ("ticks", MailboxPlace),
        ("state_at", StatePlaces),
        ("answer_at", AnswerPlaces),
        ("tick_at", TickPlaces),
        ("guards", MailboxPlace),
        ("guard_at", GuardPlaces),
        ("guard_row", ctypes.c_void_p),
        ("guard_places", ctypes.c_void_p),
        ("guard_size", ctypes.c_int64),
        ("keeps_every_s", ctypes.c_double),
        ("keeps_next", ctypes.c_double),
        ("state", ctypes.c_void_p),
        ("answer", ctypes.c_void_p),
        ("row", ctypes.c_void_p),
        ("person_places", ctypes.c_void_p),
        ("person_size", ctypes.c_int64),
        ("joints", ctypes.c_int64),
        ("modes", ctypes.c_int64),
        ("periods", ctypes.c_int64),
        ("flies", ctypes.c_int64),
        ("period_ns", ctypes.c_int64),
        ("lead_ns", ctypes.c_int64),
        ("spin_ns", ctypes.c_int64),
        ("answer_by_ns", ctypes.c_int64),
        ("poll_ns", ctypes.c_int64),
        ("given_up_after", ctypes.c_int64),
        ("asked_again_every", ctypes.c_int64),
        ("rest_at_least_every", ctypes.c_int64),
        ("alone_after_ns", ctypes.c_int64),
        ("ends_stopped", ctypes.c_int64),
        ("slope_max", ctypes.c_double),
        ("life_s", ctypes.c_double),
        ("level_s", ctypes.c_double),
        ("period_s", ctypes.c_double),
        ("gain", ctypes.c_double * core.JOINTS),
        ("period_of", ctypes.c_void_p),
        ("lateness_ns", ctypes.c_void_p),
        ("compute_ns", ctypes.c_void_p),
        # State of the loop; only the loop writes it.
        ("has_begun", ctypes.c_int64),
        ("started_ns", ctypes.c_int64),
        ("now", ctypes.c_double),
        ("safe_state", ctypes.c_int64),
        ("phase", ctypes.c_int64),
        ("mode", ctypes.c_int64),
        ("was_stopped", ctypes.c_int64),
        ("has_latched", ctypes.c_int64),
        ("is_ending", ctypes.c_int64),
        ("is_time_over", ctypes.c_int64),
        ("acts", ctypes.c_int64),
        ("persons", ctypes.c_int64),
        ("unanswered", ctypes.c_int64),
        ("silent", ctypes.c_int64),
        ("ran", ctypes.c_int64),
        ("passed", ctypes.c_int64),
        ("outcome", ctypes.c_int64),
        # Between supervisor and loop. Each number has one writer, and is written after what it counts.
        ("beat_ns", ctypes.c_int64),
        ("end_asked", ctypes.c_int64),
        ("end_taken", ctypes.c_int64),
        ("ordered", ctypes.c_int64),
        ("taken", ctypes.c_int64),
        ("orders", OrderPlace * ORDERS),
        ("happened", ctypes.c_int64),
        ("heard", ctypes.c_int64),
        ("unheard", ctypes.c_int64),
        ("happenings", HappeningPlace * HAPPENINGS),
    ]


_OF_GUARD = (
    "STOP", "SINCE_STOP", "DESCENT_S", "WORN", "LEVEL", "LEVEL_WANTED", "LEVEL_STEP", "LEVEL_MOVES", "CONSENT",
    "DRIVEN", "CAME", "SEQUENCE_IN", "T_IN", "NOW", "IN_CURRENT", "HAS_MOTOR", "SPOKE", "ANSWERS", "VALID_UNTIL",
    "USABLE", "SAFE_STATE", "Q_IN", "CURRENT_IN", "TAU_IN", "Q_MOTOR_IN", "FAULTY_IN", "ANSWER_IN", "DESIRED", "TAU",
    "ISOLATED", "POWERLESS", "DAMPING", "WITHOUT_MODEL_SHARE", "MODEL_LOST", "STOP_PRESSED",
)  # fmt: skip


def constants() -> Mapping[str, float | int]:
    """Return the constants of the loop, by their name in C."""
    named: dict[str, float | int] = {f"GUARD_{name}": getattr(core, name) for name in _OF_GUARD}
    named |= {f"ORDER_{one.name}": int(one) for one in Order} | {f"HAPPENED_{one.name}": int(one) for one in Happening}
    named |= {f"OUTCOME_{one.name}": int(one) for one in Outcome}
    named |= {"ORDERS": ORDERS, "HAPPENINGS": HAPPENINGS, "MAILBOX_SLOTS": SLOTS}
    named |= {"ACT_STOP_PRESSED": STOP_PRESSED, "ACT_TOLD_PERSON": TOLD_PERSON, "ACT_TOLD_LEVEL": TOLD_LEVEL}
    named |= {"ACT_DRIFTED": DRIFTED, "ACT_CONSENTED": CONSENTED, "CONSENT_S": CONSENT_S}
    named |= {"LEVEL_MOST": GRAVITY_LEVEL_MAX}
    return named | {"DESCENT": int(SafeState.DESCENT)}


def text() -> str:
    """Return the contents of `record.h`."""
    records = OrderPlace, HappeningPlace, MailboxPlace, StatePlaces, AnswerPlaces, TickPlaces, GuardPlaces, LiveLoop
    return header(records, constants())


if __name__ == "__main__":
    HEADER.write_text(text(), encoding="utf-8")
