"""Record that the Python driver of CANopen drives and its C translation share: link, drives and counts.

    python -m exograv.rig.drives.canopen.native.record

The command writes `record.h` from the classes and from `objects.py`. A test fails where they differ.
"""

import ctypes
import enum
from collections.abc import Mapping
from pathlib import Path

from exograv.rig.drive_status import DriveFault
from exograv.rig.drives.canopen import emergency, states
from exograv.rig.drives.canopen import objects as at
from exograv.rig.drives.canopen.node import DAMPING_MOST, MEASURED, MOTOR, PER_MILLE_MOST, SLOW
from exograv.rig.drives.canopen.objects import MASTER, CobId, Nmt
from exograv.rig.drives.canopen.states import Cia402State
from exograv.rig.drives.cycle import FRAMES_AT_ONCE
from exograv.rig.drives.native.record import JOINTS, DriveMachine
from exograv.safety.native.structs import header

HEADER = Path(__file__).with_name("record.h")

STATES = tuple(Cia402State)
"""States of a drive, by their number in the record."""

COUNTS = ("not sent", "not heard")
"""Reasons that the bus counts, in the order of `counts` in the record."""

MARK_BYTES = 8
"""Length of the mark by which a host knows its own frames on a bus that echoes them."""


class Link(enum.IntEnum):
    """Form of a frame at the socket."""

    SOCKETCAN = 0
    """`struct can_frame` of Linux."""
    MULTICAST = 1
    """Message of python-can's `udp_multicast`: a map in msgpack, as a datagram."""


class CanOwed(ctypes.Structure):
    """Answers of one kind that a drive owes, as `OwedAnswers`."""

    _fields_ = [("missing", ctypes.c_int64), ("came_late", ctypes.c_int64)]


class CanNode(ctypes.Structure):
    """Drive as `CanopenNode` knows it, in its own units and directions."""

    _fields_ = [
        ("node", ctypes.c_int64),
        ("lost_after", ctypes.c_int64),
        ("misses", ctypes.c_int64),
        ("has_answered", ctypes.c_int64),
        ("is_wanted", ctypes.c_int64),
        ("fault", ctypes.c_int64),
        ("code", ctypes.c_int64),
        ("own_fault", ctypes.c_int64),
        ("position", ctypes.c_int64),
        ("motor_position", ctypes.c_int64),
        ("current", ctypes.c_double),
        ("temperature", ctypes.c_double),
        ("amperes", ctypes.c_double),
        ("state", ctypes.c_int64),
        ("control", ctypes.c_int64),
        ("has_damping", ctypes.c_int64),
        ("measured", CanOwed),
        ("motor", CanOwed),
    ]


class CanDrives(ctypes.Structure):
    """Machine on a CAN bus. While the C loop runs, only C changes it."""

    _anonymous_ = ("machine",)
    _fields_ = [
        ("machine", DriveMachine),
        ("link", ctypes.c_int64),
        ("group", ctypes.c_uint32),
        ("port", ctypes.c_uint32),
        ("mark", ctypes.c_uint8 * MARK_BYTES),
        ("told", ctypes.c_int64),
        ("beat_every", ctypes.c_int64),
        ("each", CanNode * JOINTS),
        ("counts", ctypes.c_int64 * len(COUNTS)),
    ]


def constants() -> Mapping[str, float | int]:
    """Return the constants of frames and states, by their name in C."""
    named: dict[str, float | int] = {
        f"CAN_COB_{name}": getattr(CobId, name)
        for name in ("EMERGENCY", "MEASURED", "COMMAND", "MOTOR", "SLOW", "QUESTION", "HEARTBEAT", "NMT", "SYNC")
    }
    named |= {f"CAN_LINK_{one.name}": int(one) for one in Link}
    named |= {f"CAN_STATE_{state.name}": number for number, state in enumerate(STATES)}
    named |= {f"CAN_COUNT_{name.upper().replace(' ', '_')}": number for number, name in enumerate(COUNTS)}
    named |= {
        "CAN_MASTER": MASTER,
        "CAN_BOOTED": Nmt.BOOTED,
        "CAN_OPERATIONAL": Nmt.OPERATIONAL,
        "CAN_FRAMES_AT_ONCE": FRAMES_AT_ONCE,
        "CAN_MARK_BYTES": MARK_BYTES,
        "CAN_MEASURED_BYTES": MEASURED.size,
        "CAN_MOTOR_BYTES": MOTOR.size,
        "CAN_SLOW_BYTES": SLOW.size,
        "CAN_EMERGENCY_BYTES": emergency.FRAME.size,
        "CAN_COMMAND_BYTES": at.layout(at.COMMAND).size,
        "CAN_COMMAND_DAMPED_BYTES": at.layout((*at.COMMAND, at.DAMPING)).size,
        "CAN_DAMPING_MOST": DAMPING_MOST,
        "CAN_PER_MILLE_MOST": PER_MILLE_MOST,
        "CAN_DISABLE_VOLTAGE": states.DISABLE_VOLTAGE,
        "CAN_QUICK_STOP": states.QUICK_STOP,
        "CAN_LOST": int(DriveFault.LOST),
        "CAN_OTHER_MASTER": int(DriveFault.OTHER_MASTER),
        "CAN_INTERNAL": int(DriveFault.INTERNAL),
        "CAN_STATES": len(states.MASKED),
        "CAN_CLASSES": len(emergency.CLASSES),
    }
    return named


def tables() -> str:
    """Return the tables of status words and of emergency codes, in C: mask, masked value, and number."""
    words = [f"{{0x{mask:x}, 0x{value:x}, {STATES.index(state)}}}" for mask, value, state in states.MASKED]
    codes = [f"{{0x{mask:x}, 0x{value:x}, {int(fault)}}}" for mask, value, fault in emergency.CLASSES]
    rows = {"can_states[CAN_STATES]": words, "can_classes[CAN_CLASSES]": codes}
    return "".join(f"static const int64_t {name}[3] = {{{', '.join(of)}}};\n" for name, of in rows.items())


def text() -> str:
    """Return the contents of `record.h`."""
    return header((CanOwed, CanNode, CanDrives), constants(), ["../../native/machine.h"]) + tables()


if __name__ == "__main__":
    HEADER.write_text(text(), encoding="utf-8")
