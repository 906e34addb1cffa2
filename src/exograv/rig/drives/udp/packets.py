"""Conversion of packets to bytes and back.

Bytes that are not a valid packet of this protocol are refused with a reason.
"""

import enum
import math
import zlib
from typing import Any, NamedTuple

from .layout import (
    CRC_BYTES,
    HEADER,
    HEADER_BYTES,
    JOINTS_MAX,
    LAYOUTS,
    MAGIC,
    NAME_BYTES,
    NAMEPLATE_JOINT,
    VERSION,
    Type,
    length,
    packed,
)

_HEADER, _CRC = packed(HEADER), packed((HEADER[0],))
_OWN = {kind: packed(layout.fields) for kind, layout in LAYOUTS.items()}
_JOINTS = {
    (kind, n): packed(layout.joint * n) for kind, layout in LAYOUTS.items() for n in range(JOINTS_MAX + 1)
}  # made once, so that no tick parses a format
_LENGTHS = {(kind, n): length(kind, n) for kind in Type for n in range(JOINTS_MAX + 1)}
_TYPES = {int(kind): kind for kind in Type}


class Refusal(enum.Enum):
    """Reason why a packet is refused."""

    LENGTH = "length"
    CRC = "crc"
    MAGIC = "magic"
    VERSION = "version"
    TYPE = "type"
    NUMBER = "number"
    """A value is not finite, or out of range."""
    SESSION = "session"
    """The packet belongs to another session, or to none."""
    SEQUENCE = "sequence"
    """The packet is not newer than the newest one."""
    DEAD = "dead"
    """The command has expired on its way, or answers a state that is forgotten."""


class RefusedError(Exception):
    """Refusal of a packet. The drivers catch and count it."""

    def __init__(self, why: Refusal):
        super().__init__(why.value)
        self.why = why


class Header(NamedTuple):
    """Header as in `layout.HEADER`, without magic and version."""

    kind: Type
    joints: int
    flags: int
    session: int
    grant: int
    sequence: int
    answers: int
    time_ns: int


class Packet(NamedTuple):
    """Header, the fields of the packet, and the fields of all joints in sequence."""

    header: Header
    own: tuple[Any, ...]
    joints: tuple[Any, ...]


def encode(header: Header, own: tuple[Any, ...] = (), joints: tuple[Any, ...] = ()) -> bytes:
    """Return the packet's bytes, filled up to the length of its type."""
    kind, n = header.kind, header.joints
    body = b"".join(
        (
            _HEADER.pack(MAGIC, VERSION, kind, *header[1:]),
            _OWN[kind].pack(*own),
            _JOINTS[kind, len(joints) // max(len(LAYOUTS[kind].joint), 1)].pack(*joints),
        )
    ).ljust(_LENGTHS[kind, n] - CRC_BYTES, b"\0")
    return body + _CRC.pack(zlib.crc32(body))


def decode(data: bytes) -> Packet:
    """Return the packet that these bytes contain.

    Raises:
        RefusedError: The bytes are not a valid packet.
    """
    if len(data) < HEADER_BYTES + CRC_BYTES:
        raise RefusedError(Refusal.LENGTH)
    magic, version, kind, n, *rest = _HEADER.unpack_from(data)
    if magic != MAGIC:
        raise RefusedError(Refusal.MAGIC)
    if version != VERSION:
        raise RefusedError(Refusal.VERSION)
    if kind not in _TYPES:
        raise RefusedError(Refusal.TYPE)
    kind = _TYPES[kind]
    if n > JOINTS_MAX or len(data) != _LENGTHS[kind, n] or (kind is Type.HELLO and n):
        raise RefusedError(Refusal.LENGTH)
    if _CRC.unpack_from(data, len(data) - CRC_BYTES)[0] != zlib.crc32(memoryview(data)[:-CRC_BYTES]):
        raise RefusedError(Refusal.CRC)
    layout = LAYOUTS[kind]
    own = _OWN[kind].unpack_from(data, HEADER_BYTES)
    joints = _JOINTS[kind, n].unpack_from(data, layout.joints_at) if layout.joint else ()
    return Packet(Header(kind, n, *rest), own, joints)


class Nameplate(NamedTuple):
    """Nameplate of one of a controller's drives."""

    joint: str
    current_rated_A: float
    current_max_A: float
    brake_Nms_per_rad: float
    counts_samples: bool
    """True if the states say which sample of the drive they carry."""


def nameplates(packet: Packet) -> list[Nameplate]:
    """Return the nameplate of each joint.

    Raises:
        RefusedError: A name is not valid UTF-8.
    """
    step, plates = len(NAMEPLATE_JOINT), []
    for k in range(packet.header.joints):
        name, rated, most, brake, counts = packet.joints[k * step : (k + 1) * step]
        try:
            plates.append(Nameplate(name.rstrip(b"\0").decode("utf-8"), rated, most, brake, counts == 1))
        except UnicodeDecodeError as error:
            raise RefusedError(Refusal.NUMBER) from error
    return plates


def name_bytes(joint: str) -> bytes:
    """Name of a joint as bytes of a packet; a longer name is cut."""
    return joint.encode("utf-8")[:NAME_BYTES].ljust(NAME_BYTES, b"\0")


def refuse_wrong_command(packet: Packet) -> None:
    """Refuse a current that is not finite, and a damping that is not finite or negative.

    Raises:
        RefusedError: A value is not valid.
    """
    joints = packet.joints
    if not all(map(math.isfinite, joints)) or (joints and min(joints[1::2]) < 0.0):
        raise RefusedError(Refusal.NUMBER)
