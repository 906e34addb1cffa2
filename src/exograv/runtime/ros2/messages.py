"""Messages of ROS 2 that the bridge uses: their bytes, names and hashes.

Bytes are plain CDR, little-endian, as `rmw_zenoh_cpp` writes them. A value is aligned to its own size, counted from the
end of the header of four bytes. A text ends with a zero byte, which its length counts. A sequence begins with its
length. Source: OMG DDSI-RTPS 2.5, section 10, and OMG CORBA 3.3 part 2, section 9.3.
"""

import struct
from collections.abc import Sequence
from dataclasses import dataclass

LITTLE_ENDIAN = b"\x00\x01\x00\x00"
FLOAT64_BYTES = 12
"""Length of a `Float64`: a header of 4 and a value of 8 bytes."""


@dataclass(frozen=True)
class MessageType:
    """Type of a message."""

    name: str
    """Name as on ROS 2's command line: package, `msg`, type."""

    hash: str
    """Hash RIHS01 of the type's description (REP-2016), equal in Iron, Jazzy, Kilted and Lyrical."""

    @property
    def dds_name(self) -> str:
        """Name in the keys of Zenoh."""
        package, kind, name = self.name.split("/")
        return f"{package}::{kind}::dds_::{name}_"


# The tests compute these hashes from the descriptions. `rosbags` 0.11.9 computes the same from its own .msg files.
JOINT_STATE = MessageType(
    "sensor_msgs/msg/JointState", "RIHS01_a13ee3a330e346c9d87b5aa18d24e11690752bd33a0350f11c5882bc9179260e"
)
FLOAT64 = MessageType("std_msgs/msg/Float64", "RIHS01_705ba9c3d1a09df43737eb67095534de36fd426c0587779bda2bc51fe790182a")
# The design document of rmw_zenoh shows this hash in its example.
STRING = MessageType("std_msgs/msg/String", "RIHS01_df668c740482bbd48fb39d76a70dfd4bd59db1288021743503259e948f6b1a18")


class _Writer:
    def __init__(self):
        self._bytes = bytearray()

    @property
    def message(self) -> bytes:
        return LITTLE_ENDIAN + bytes(self._bytes)

    def align(self, size: int) -> None:
        self._bytes += bytes(-len(self._bytes) % size)

    def uint32(self, value: int) -> None:
        self.align(4)
        self._bytes += struct.pack("<I", value)

    def text(self, value: str) -> None:
        content = value.encode() + b"\0"
        self.uint32(len(content))
        self._bytes += content

    def float64s(self, values: Sequence[float]) -> None:
        """Append a sequence. An empty one has only its length, because there is no value to align."""
        self.uint32(len(values))
        if values:
            self.align(8)
            self._bytes += struct.pack(f"<{len(values)}d", *values)


def joint_state(
    stamp_ns: int,
    names: Sequence[str],
    position: Sequence[float],
    velocity: Sequence[float],
    effort: Sequence[float],
) -> bytes:
    """Return a `JointState`.

    Args:
        stamp_ns: Time of the measurement since 1970 [ns].
        names: Names of the joints.
        position: Position of each joint [rad].
        velocity: Velocity of each joint [rad/s]; empty if it is unknown.
        effort: Torque of each joint [N·m]; empty if it is unknown.
    """
    writer = _Writer()
    seconds, rest = divmod(stamp_ns, 1_000_000_000)
    writer.uint32(seconds & 0xFFFFFFFF)
    writer.uint32(rest)
    writer.text("")  # no frame: joints have none
    writer.uint32(len(names))
    for name in names:
        writer.text(name)
    for values in (position, velocity, effort):
        writer.float64s(values)
    return writer.message


def float64(value: float) -> bytes:
    """Return a `Float64` message as bytes."""
    return LITTLE_ENDIAN + struct.pack("<d", value)


def string(value: str) -> bytes:
    """Return a `String` message as bytes."""
    writer = _Writer()
    writer.text(value)
    return writer.message


def read_float64(message: bytes) -> float | None:
    """Return the number in a `Float64` of either byte order; None for another message."""
    # The last two bytes of the header are free, and padding may follow the value.
    if not FLOAT64_BYTES <= len(message) <= FLOAT64_BYTES + 4 or message[0] != 0 or message[1] > 1:
        return None
    return struct.unpack_from("<d" if message[1] else ">d", message, 4)[0]
