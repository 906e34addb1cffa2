"""Record of a machine of drives, the first part of each bus's own record: outside world, measurement and units.

    python -m exograv.rig.drives.native.record

The command writes `record.h` from the class. A test fails where they differ.
"""

import ctypes
from collections.abc import Mapping
from pathlib import Path

from exograv.safety.native import core
from exograv.safety.native.structs import header

HEADER = Path(__file__).with_name("record.h")

JOINTS = core.JOINTS
"""Largest number of joints of a machine."""

NOTHING, FAILED = -1, -2
"""Results of `receive_hook` that are no size of a datagram: none came in time, and the system reports an error."""

_Joints = ctypes.c_double * JOINTS


class DriveMachine(ctypes.Structure):
    """Machine of drives, as `Driver`, `Clock` and `Units` know it. While the C loop runs, only C changes it."""

    _fields_ = [
        # Functions of the outside world; 0 is the operating system's. Tests have a world of their own.
        ("now_hook", ctypes.c_void_p),
        ("sleep_hook", ctypes.c_void_p),
        ("send_hook", ctypes.c_void_p),
        ("receive_hook", ctypes.c_void_p),
        ("socket", ctypes.c_int64),
        ("joints", ctypes.c_int64),
        ("tick", ctypes.c_int64),
        ("answer_ns", ctypes.c_int64),
        ("began_s", ctypes.c_double),
        ("is_on", ctypes.c_int64),
        ("has_motor", ctypes.c_int64),
        ("sign", _Joints),
        ("offset", _Joints),
        ("of_count", _Joints),
        ("of_motor_count", _Joints),
        ("current_max", _Joints),
        # Measurement: time of its question [s], number of its tick, and the joints.
        ("state_t", ctypes.c_double),
        ("state_sequence", ctypes.c_int64),
        ("has_q_motor", ctypes.c_int64),
        ("faulty", ctypes.c_int64),
        ("q", _Joints),
        ("joint_current", _Joints),
        ("q_motor", _Joints),
        ("limited", ctypes.c_int64),
        ("expired", ctypes.c_int64),
        ("incomplete", ctypes.c_int64),
    ]


Now = ctypes.CFUNCTYPE(ctypes.c_int64, ctypes.c_void_p)
Sleep = ctypes.CFUNCTYPE(None, ctypes.c_void_p, ctypes.c_int64)
Send = ctypes.CFUNCTYPE(ctypes.c_int64, ctypes.c_void_p, ctypes.c_void_p, ctypes.c_int64)
Receive = ctypes.CFUNCTYPE(ctypes.c_int64, ctypes.c_void_p, ctypes.c_void_p, ctypes.c_int64, ctypes.c_int64)


def constants() -> Mapping[str, float | int]:
    """Return the constants that all buses share, by their name in C."""
    return {"DRIVE_JOINTS": JOINTS, "MACHINE_NOTHING": NOTHING, "MACHINE_FAILED": FAILED}


def text() -> str:
    """Return the contents of `record.h`."""
    return header((DriveMachine,), constants())


if __name__ == "__main__":
    HEADER.write_text(text(), encoding="utf-8")
