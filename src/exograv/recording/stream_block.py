"""Samples of another device's stream as one message: raw stamps and raw values in the device's own type.

The encoding is plain CDR, as ROS 2 uses it, with sequences. A viewer reads it by the schema in the file.
"""

import struct
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from jaxtyping import Float

from .encoding import CDR_HEADER

TOPICS = "/lsl/"
"""Prefix of the topics of other devices; the rest is made from the stream's name."""

GAP_PERIODS = 2.0
"""Interval between two stamps above which samples are missing [nominal periods]."""

HEAD = struct.Struct("<dII")
"""`received` [s], `connection`, `channels`."""

TYPES = {
    "float32": "float32",
    "double64": "float64",
    "string": "string",
    "int8": "int8",
    "int16": "int16",
    "int32": "int32",
    "int64": "int64",
}
"""Names of types in ROS 2, by their names in LSL."""

DEFINITION = """\
float64 received  # CLOCK_MONOTONIC when the last of these samples had been taken from LSL [s]
uint32 connection  # number from 1; each connection may have another clock
uint32 channels  # values per sample
float64[] stamps  # of the samples, exactly as received: the device's own clock [s]
{type}[] values  # exactly as received, sample after sample
"""


@dataclass(frozen=True)
class StreamFormat:
    """Format of a stream that the file must know before the first sample."""

    topic: str
    value_type: str
    """Value type by LSL's name, a key of `TYPES`."""

    @property
    def schema_name(self) -> str:
        """Name of the message type in the file."""
        return f"exograv/msg/Lsl{self.value_type.title()}"

    @property
    def definition(self) -> str:
        """Message in ROS 2's interface language."""
        return DEFINITION.format(type=TYPES[self.value_type])


@dataclass(frozen=True)
class StreamBlock:
    """Samples that arrived together."""

    received: float
    """CLOCK_MONOTONIC when the last sample had been taken from LSL [s]."""

    connection: int
    stamps: Float[np.ndarray, " sample"]
    """Time stamps as received [s]."""

    values: Any
    """Values as received: an array (sample, channel), or a list of lists for strings."""


def value_type_of(schema_name: str) -> str:
    """Return LSL's name of the type in a `StreamFormat.schema_name`."""
    return schema_name.removeprefix("exograv/msg/Lsl").lower()


def packed(block: StreamBlock, channels: int) -> bytes:
    """Return the message of a block."""
    stamps = np.ascontiguousarray(block.stamps, "<f8")
    head = HEAD.pack(block.received, block.connection, channels) + struct.pack("<I4x", len(stamps)) + stamps.tobytes()
    if isinstance(block.values, np.ndarray):
        values = np.ascontiguousarray(block.values)
        body = struct.pack("<I", values.size) + bytes(4 * (values.itemsize == 8)) + values.tobytes()
    else:
        body = _packed_texts([text for sample in block.values for text in sample])
    return CDR_HEADER + head + body


def unpacked(data: bytes, value_type: str) -> StreamBlock:
    """Return the block of a message that `packed` has made."""
    received, connection, channels = HEAD.unpack_from(data, 4)
    (count,) = struct.unpack_from("<I", data, 4 + HEAD.size)
    start = 4 + HEAD.size + 8
    stamps, start = np.frombuffer(data, "<f8", count, start), start + 8 * count
    (size,) = struct.unpack_from("<I", data, start)
    if value_type == "string":
        texts = _unpacked_texts(data, start + 4, size)
        values: Any = [texts[first : first + channels] for first in range(0, size, channels)]
    else:
        kind = np.dtype(TYPES[value_type]).newbyteorder("<")
        begin = start + 4 + 4 * (kind.itemsize == 8)
        values = np.frombuffer(data, kind, size, begin).reshape(count, channels)
    return StreamBlock(received, connection, stamps, values)


def with_connection(data: bytes, added: int) -> tuple[bytes, int, float]:
    """Return a message whose number of the connection is higher by `added`, this number, and `received` [s]."""
    received, connection, channels = HEAD.unpack_from(data, len(CDR_HEADER))
    head = HEAD.pack(received, connection + added, channels)
    return CDR_HEADER + head + data[len(CDR_HEADER) + HEAD.size :], connection + added, received


def packed_size(samples: int, channels: int, item_bytes: int) -> int:
    """Return the size of a message of numbers [bytes]."""
    return 4 + HEAD.size + 8 + 8 * samples + 8 + samples * channels * item_bytes


def _packed_texts(texts: Sequence[str]) -> bytes:
    body = bytearray(struct.pack("<I", len(texts)))
    for text in texts:
        content = text.encode(errors="surrogateescape") + b"\0"
        body += bytes(-len(body) % 4) + struct.pack("<I", len(content)) + content
    return bytes(body)


def _unpacked_texts(data: bytes, start: int, count: int) -> list[str]:
    texts = list[str]()
    for _ in range(count):
        start += -(start - 4) % 4  # CDR counts from the end of its header
        (size,) = struct.unpack_from("<I", data, start)
        texts.append(data[start + 4 : start + 4 + size - 1].decode(errors="surrogateescape"))
        start += 4 + size
    return texts
