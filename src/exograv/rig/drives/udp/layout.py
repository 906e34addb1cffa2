"""Layout of every byte of the UDP protocol, as data.

The documentation's tables, the C header and both peers are tested against it. Little endian, no padding: each field
lies at a multiple of its own size, so that a C struct has the same layout.
"""

import enum
import struct
from collections.abc import Mapping
from types import MappingProxyType
from typing import NamedTuple

MAGIC = 0x56475845
"""Magic number, the bytes "EXGV"."""
VERSION = 1
JOINTS_MAX = 16
NAME_BYTES = 32

SEQUENCES = 2**32
"""Number of sequences; the one after the last is 0."""


class Type(enum.IntEnum):
    """Type of a packet."""

    HELLO = 1
    NAMEPLATE = 2
    POLL = 3
    STATE = 4
    COMMAND = 5
    BYE = 6


PURPOSES: Mapping[Type, str] = MappingProxyType(
    {
        Type.HELLO: "host: begin a session; `joints` and `grant` are 0",
        Type.NAMEPLATE: "controller: answer to HELLO, with joints and limits",
        Type.POLL: "host: ask for the state",
        Type.STATE: "controller: answer to POLL",
        Type.COMMAND: "host: currents and damping; not answered",
        Type.BYE: "host: motors off, end of the session; not answered",
    }
)
"""Sender and purpose of each type of packet."""


class Flag(enum.IntFlag):
    """Flags of a packet."""

    NONE = 0
    ENABLE = 1
    ACKNOWLEDGE = 2
    TAKEN = 4


FLAG_MEANINGS: Mapping[Flag, str] = MappingProxyType(
    {
        Flag.ENABLE: "in a command: switch the motors on",
        Flag.ACKNOWLEDGE: "in a command without ENABLE: clear faults whose cause is gone",
        Flag.TAKEN: "in a nameplate: another host has the controller",
    }
)
"""Meaning of each flag of a packet."""


class DriveFlag(enum.IntFlag):
    """Status bits of one drive in a state."""

    NONE = 0
    ENABLED = 1
    PRESENT = 2


STATUS_MEANINGS: Mapping[DriveFlag, str] = MappingProxyType(
    {
        DriveFlag.ENABLED: "the motor gives the commanded torque",
        DriveFlag.PRESENT: "the drive answers the controller; without this bit the joint's numbers have no meaning",
    }
)
"""Meaning of each status bit of a drive."""


class PacketField(NamedTuple):
    """Field of a packet: one number, or a name."""

    name: str
    kind: str
    """Type as in C: u8, u16, u32, u64, f32, f64; or char."""
    unit: str
    meaning: str


FORMATS = {"u8": "B", "u16": "H", "u32": "I", "u64": "Q", "f32": "f", "f64": "d", "char": f"{NAME_BYTES}s"}

HEADER = (
    PacketField("magic", "u32", "", f"0x{MAGIC:08x}, the bytes `EXGV`"),
    PacketField("version", "u8", "", f"{VERSION}"),
    PacketField("type", "u8", "", "type of the packet"),
    PacketField("joints", "u8", "", f"number of joints in this packet, 0 to {JOINTS_MAX}"),
    PacketField("flags", "u8", "", "flags, as bits"),
    PacketField("session", "u32", "", "chosen by the host at random, not 0"),
    PacketField("grant", "u32", "", "chosen by the controller at random for each session, not 0; 0 before the session"),
    PacketField("sequence", "u32", "", "number of the packet among its sender's in this session; 0 follows the last"),
    PacketField("answers", "u32", "", "sequence of the packet that this one answers; 0 if none"),
    PacketField("time_ns", "u64", "ns", "time of sending, on the sender's own monotonic clock"),
)

NAMEPLATE = (
    PacketField("watchdog_us", "u32", "µs", "time without a command after which the drives brake"),
    PacketField("period_us", "u32", "µs", "period of the loop for which the controller is set"),
)
NAMEPLATE_JOINT = (
    PacketField("name", "char", "", f"name of the joint, UTF-8, filled with zeros to {NAME_BYTES} bytes"),
    PacketField("current_rated_A", "f32", "A", "continuous current of the motor"),
    PacketField("current_max_A", "f32", "A", "limit that the drive applies itself"),
    PacketField("brake_Nms_per_rad", "f32", "N·m·s/rad", "damping with which the drive brakes by itself"),
    PacketField("counts_samples", "u32", "", "1 if the states count the samples of this drive, 0 if not"),
)
STATE = (
    PacketField("command", "u32", "", "sequence of the newest accepted command, 0 if none"),
    PacketField("refused", "u32", "", "number of refused packets since the controller started"),
)
STATE_JOINT = (
    PacketField("position", "f64", "rad", "position of the joint, in the drive's direction and from its zero"),
    PacketField(
        "motor_position",
        "f64",
        "rad",
        "position from the encoder on the motor's shaft, as angle of the joint; NaN without one",
    ),
    PacketField("current", "f32", "A", "measured motor current"),
    PacketField("temperature", "f32", "°C", "temperature of the winding; NaN if not measured"),
    PacketField("status", "u16", "", "bits, below"),
    PacketField("fault", "u16", "", "bits, below"),
    PacketField("code", "u16", "", "error code of the maker, 0 for none"),
    PacketField("samples", "u16", "", "number of the newest sample of this drive; 0 follows the last"),
)
COMMAND = (
    PacketField("age_us", "u32", "µs", "time from sending the poll of the answered state to sending this packet"),
    PacketField("life_us", "u32", "µs", "life of the command from its receipt"),
)
COMMAND_JOINT = (
    PacketField("current", "f32", "A", "motor current, in the drive's direction"),
    PacketField("damping", "f32", "N·m·s/rad", "additional damping of the motor by the drive, from its own encoder"),
)


def packed(fields: tuple[PacketField, ...]) -> struct.Struct:
    """Return the `struct` that reads and writes these fields."""
    return struct.Struct("<" + "".join(FORMATS[field.kind] for field in fields))


def offsets(fields: tuple[PacketField, ...], begin: int = 0) -> dict[str, int]:
    """Offset of each field [byte]."""
    return {field.name: begin + packed(fields[:k]).size for k, field in enumerate(fields)}


HEADER_BYTES = packed(HEADER).size
CRC_BYTES = 4
"""Size of the check sum at the end of every packet: CRC-32 of zlib over all bytes before it."""


class PacketLayout(NamedTuple):
    """Layout of one type of packet: the header, the fields of the packet, and the fields of each joint."""

    fields: tuple[PacketField, ...] = ()
    joint: tuple[PacketField, ...] = ()

    @property
    def joints_at(self) -> int:
        """Offset of the first joint [byte]."""
        return HEADER_BYTES + packed(self.fields).size

    def size(self, joints: int) -> int:
        """Size of the whole packet [byte]."""
        return self.joints_at + joints * packed(self.joint).size + CRC_BYTES


_NAMEPLATE, _STATE = PacketLayout(NAMEPLATE, NAMEPLATE_JOINT), PacketLayout(STATE, STATE_JOINT)
LAYOUTS = {
    Type.HELLO: PacketLayout(),
    Type.NAMEPLATE: _NAMEPLATE,
    Type.POLL: PacketLayout(),
    Type.STATE: _STATE,
    Type.COMMAND: PacketLayout(COMMAND, COMMAND_JOINT),
    Type.BYE: PacketLayout(),
}

PARTS = {"header": (HEADER, 0)} | {
    name: part
    for kind, layout in LAYOUTS.items()
    if layout.fields
    for name, part in (
        (kind.name.lower(), (layout.fields, HEADER_BYTES)),
        (f"{kind.name.lower()}_joint", (layout.joint, 0)),
    )
}
"""Fields of each part of a packet with the byte at which they begin; a joint's block begins at its own byte 0."""


def length(kind: Type, joints: int) -> int:
    """Size of a packet [byte].

    A request is as long as its answer, filled with zeros, so that the controller cannot be used to amplify traffic.
    """
    if kind in (Type.HELLO, Type.NAMEPLATE):
        return _NAMEPLATE.size(JOINTS_MAX)
    return (_STATE if kind is Type.POLL else LAYOUTS[kind]).size(joints)


def is_newer(sequence: int, than: int) -> bool:
    """Return True if `sequence` is newer than `than`, also across the wrap."""
    return 0 < (sequence - than) % SEQUENCES < SEQUENCES // 2
