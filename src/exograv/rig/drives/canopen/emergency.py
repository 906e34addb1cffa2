"""Meaning of a drive's emergency frame. Source: CiA 301, classes of error codes; CiA 402, error codes of drives."""

import struct

from exograv.rig.drive_status import DriveFault

FRAME = struct.Struct("<HB")
"""Code and error register; five bytes of the maker's own follow."""

CLASSES = (
    (0xFFFF, 0x8140, DriveFault.NONE),  # recovered from bus off: a consequence has a code of its own
    (0xFF00, 0x8100, DriveFault.WATCHDOG),
    (0xFF00, 0x8200, DriveFault.WATCHDOG),
    (0xFF00, 0x7300, DriveFault.ENCODER),
    (0xFF00, 0x9000, DriveFault.STOP_LINE),
    (0xF000, 0x2000, DriveFault.CURRENT),
    (0xF000, 0x4000, DriveFault.TEMPERATURE),
    (0xFFFF, 0x0000, DriveFault.NONE),
)
"""Mask of a code, its masked value, and the fault. All other codes are internal faults."""


def fault_of(code: int) -> DriveFault:
    """Return the fault that an error code reports."""
    for mask, value, fault in CLASSES:
        if code & mask == value:
            return fault
    return DriveFault.INTERNAL
