"""Objects of a drive, the frames that carry them, and the numbers of the frames.

Source: CiA 301 (communication, 0x1xxx) and CiA 402 (drives, 0x6xxx); 0x2xxx belongs to each maker.
"""

import struct
from dataclasses import dataclass


@dataclass(frozen=True)
class Entry:
    """Object of a drive."""

    index: int
    sub: int
    format: str
    """Format of `struct`, little-endian: B, H, I unsigned, b, h, i signed, of 8, 16 and 32 bit."""

    @property
    def bits(self) -> int:
        """Number of bits, as in a mapping."""
        return 8 * struct.calcsize(self.format)

    @property
    def mapping(self) -> int:
        """Entry of this object in a PDO's mapping."""
        return self.index << 16 | self.sub << 8 | self.bits

    def __str__(self) -> str:
        return f"0x{self.index:04X}:{self.sub:02X}"


DEVICE_TYPE = Entry(0x1000, 0, "I")
HEARTBEAT_WATCHED = Entry(0x1016, 1, "I")
"""Heartbeat that the drive watches: node << 16, and the time-out [ms]."""
HEARTBEAT_MS = Entry(0x1017, 0, "H")
ERROR_BEHAVIOUR = Entry(0x1029, 1, "B")
"""NMT state of the drive after a communication error; 1: unchanged, so that its measurements continue."""

ERROR_CODE = Entry(0x603F, 0, "H")
CONTROL_WORD = Entry(0x6040, 0, "H")
STATUS_WORD = Entry(0x6041, 0, "H")
CONNECTION_LOST = Entry(0x6007, 0, "h")
QUICK_STOP = Entry(0x605A, 0, "h")
FAULT_REACTION = Entry(0x605E, 0, "h")
MODE = Entry(0x6060, 0, "b")
POSITION = Entry(0x6064, 0, "i")
TARGET_TORQUE = Entry(0x6071, 0, "h")
MAX_TORQUE = Entry(0x6072, 0, "H")
RATED_CURRENT = Entry(0x6075, 0, "I")
TORQUE = Entry(0x6077, 0, "h")
MOTOR_POSITION = Entry(0x60E4, 1, "i")
"""Additional position actual value: position of the encoder on the motor's shaft."""
SUPPORTED_MODES = Entry(0x6502, 0, "I")

DAMPING = Entry(0x2100, 0, "H")
"""Damping by the drive's own encoder [mN·m·s/rad]; an object of some makers and of our simulated drive."""
TEMPERATURE = Entry(0x2101, 0, "h")
"""Temperature of the winding [0.1 °C]; an object of some makers and of our simulated drive."""

CYCLIC_TORQUE = 10
"""Cyclic synchronous torque, as mode. As bit of `SUPPORTED_MODES` it is one less."""
IS_402 = 402
"""Number of the device profile CiA 402, in the low half of the object "device type"."""

COMMAND = (CONTROL_WORD, TARGET_TORQUE)
"""Objects of the command frame to each drive; `DAMPING` follows if the drive has it."""
MEASURED = (STATUS_WORD, POSITION, TORQUE)
MOTOR = (MOTOR_POSITION,)
SLOW = (TEMPERATURE,)

SLOW_SYNCS = 50
"""Number of SYNCs between two temperatures of the winding: 10 Hz at 2 ms."""


class CobId:
    """Numbers of frames; a node's own number is added to those of the first group."""

    EMERGENCY = 0x080
    MEASURED = 0x180
    COMMAND = 0x200
    MOTOR = 0x280
    SLOW = 0x380
    ANSWER = 0x580
    QUESTION = 0x600
    HEARTBEAT = 0x700

    NMT = 0x000
    SYNC = 0x080


class Nmt:
    """Commands to a node, and states in its heartbeat."""

    START = 0x01
    PRE_OPERATIONAL = 0x80

    BOOTED = 0x00
    OPERATIONAL = 0x05


MASTER = 127
"""Node number of the host, whose heartbeat the drives watch."""


def layout(entries: tuple[Entry, ...]) -> struct.Struct:
    """Layout of these objects in one frame."""
    return struct.Struct("<" + "".join(entry.format for entry in entries))
