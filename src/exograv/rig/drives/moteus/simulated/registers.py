"""Registers of a moteus and their encoding: bytes to writes and reads, values to bytes.

Source: mjbots moteus, docs/protocol/can.md and registers.md; written without the maker's library.
"""

import math
import struct
from collections.abc import Iterator, Sequence
from typing import NamedTuple

Number = float | int
TYPES = (struct.Struct("<b"), struct.Struct("<h"), struct.Struct("<i"), struct.Struct("<f"))
NONE = (-(2**7), -(2**15), -(2**31))
"""Integer codes of "not a number", by size."""

MODE, POSITION, VELOCITY, TORQUE, CURRENT, HOME, VOLTAGE, TEMPERATURE, FAULT = 0, 1, 2, 3, 4, 0xC, 0xD, 0xE, 0xF
TO_POSITION, TO_VELOCITY, FEEDFORWARD, KP_SCALE, KD_SCALE, MOST_TORQUE = range(0x20, 0x26)
TIMEOUT, VELOCITY_LIMIT, ACCELERATION_LIMIT, I_LIMIT_SCALE = 0x27, 0x28, 0x29, 0x2B
FIRMWARE, MAP = 0x101, 0x102

TURNS, TURNS_PER_s, NEWTON_METRES = (0.01, 1e-4, 1e-5), (0.1, 2.5e-4, 1e-5), (0.5, 0.01, 0.001)
SHARE, AMPERES, CELSIUS = (1 / 127, 1 / 32767, 1 / 2147483647), (1.0, 0.1, 0.001), (1.0, 0.1, 0.001)
SECONDS, VOLTS, PER_s2 = (0.01, 0.001, 1e-6), (0.5, 0.1, 0.001), (0.05, 0.001, 1e-5)
STEPS = {
    POSITION: TURNS, VELOCITY: TURNS_PER_s, TORQUE: NEWTON_METRES, CURRENT: AMPERES, VOLTAGE: VOLTS,
    TEMPERATURE: CELSIUS, TO_POSITION: TURNS, TO_VELOCITY: TURNS_PER_s, FEEDFORWARD: NEWTON_METRES,
    KP_SCALE: SHARE, KD_SCALE: SHARE, MOST_TORQUE: NEWTON_METRES, TIMEOUT: SECONDS, VELOCITY_LIMIT: TURNS_PER_s,
    ACCELERATION_LIMIT: PER_s2, I_LIMIT_SCALE: SHARE,
}  # fmt: skip
"""Units of values with one, two and four bytes; every other register is a whole number."""

WRITE, READ, REPLY, READ_ERROR, TO_DRIVE, FROM_DRIVE, POLL, NOTHING = 0x00, 0x10, 0x20, 0x31, 0x40, 0x41, 0x42, 0x50


class Subframe(NamedTuple):
    """Part of a frame: one write, read, reply or stream."""

    kind: int
    type: int
    """Type of the values, an index of `TYPES`; channel of a stream."""
    first: int
    """First register; of a poll, the largest size of the answer."""
    values: tuple[Number, ...] = ()
    n: int = 0
    """Number of registers in the subframe."""
    text: bytes = b""


def subframes(data: bytes) -> Iterator[Subframe]:
    """Yield the complete subframes of a frame. If the frame is cut off, those before the cut are valid."""
    k = 0
    while k < len(data):
        try:
            subframe, k = _next(data, k)
        except (IndexError, struct.error):
            return
        if subframe is None:
            return
        if subframe.kind != NOTHING:
            yield subframe


def _next(data: bytes, k: int) -> tuple[Subframe | None, int]:
    head, k = data[k], k + 1
    if head == NOTHING:
        return Subframe(NOTHING, 0, 0), k
    if head in (TO_DRIVE, POLL):
        channel, k = _varuint(data, k)
        size, k = _varuint(data, k)
        if head == POLL:
            return Subframe(POLL, channel, size), k
        return Subframe(TO_DRIVE, channel, 0, text=data[k : k + size]), k + size
    kind, kind_of_value = head & 0xF0, head >> 2 & 0b11
    if kind not in (WRITE, READ):
        return None, k
    count = head & 0b11
    if not count:
        count, k = _varuint(data, k)
    first, k = _varuint(data, k)
    if kind == READ:
        return Subframe(READ, kind_of_value, first, n=count), k
    layout, values = TYPES[kind_of_value], []
    for j in range(count):
        (raw,) = layout.unpack_from(data, k)
        values.append(_value(first + j, kind_of_value, raw))
        k += layout.size
    return Subframe(WRITE, kind_of_value, first, tuple(values), count), k


def _value(register: int, kind: int, raw: Number) -> Number:
    if kind == len(NONE) or register not in STEPS:
        return raw
    return math.nan if raw == NONE[kind] else raw * STEPS[register][kind]


def _varuint(data: bytes, k: int) -> tuple[int, int]:
    value = shift = 0
    while True:
        value |= (data[k] & 0x7F) << shift
        if not data[k] & 0x80:
            return value, k + 1
        k, shift = k + 1, shift + 7


def varuint(value: int) -> bytes:
    """Encode an integer with seven bits per byte, the lowest first."""
    out = bytearray()
    while value > 0x7F:
        out.append(value & 0x7F | 0x80)
        value >>= 7
    return bytes((*out, value))


def reply(kind: int, first: int, values: Sequence[Number]) -> bytes:
    """Reply to a read of these registers."""
    count = len(values)
    few = count if 0 < count <= 3 else 0
    head = bytes((REPLY | kind << 2 | few,)) + (b"" if few else varuint(count)) + varuint(first)
    return head + b"".join(_bytes(first + j, kind, value) for j, value in enumerate(values))


def _bytes(register: int, kind: int, value: Number) -> bytes:
    if kind == len(NONE):
        return TYPES[kind].pack(value)
    if not math.isfinite(value):
        return TYPES[kind].pack(NONE[kind])
    most = -NONE[kind] - 1
    step = STEPS[register][kind] if register in STEPS else 1
    return TYPES[kind].pack(int(min(max(value / step, -most), most)))
