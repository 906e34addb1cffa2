"""What is said to a moteus and what it answers: encoded by the maker's library once, and filled in at every tick.

The library needs some 45 µs to encode one command, and as long to decode one answer; a machine needs several of each.
"""

import math
import struct
from typing import NamedTuple

from moteus import (
    F32,
    IGNORE,
    INT8,
    Controller,
    PositionResolution,
    QueryResolution,
    Register,
    parse_registers,
)

from .fdcanusb import head, line

FLOAT, ANSWER = struct.Struct("<f"), struct.Struct("<2sb2sf2sf2s3b")
REPLIES = 0x10
"""Between the first byte of a question and that of its answer."""

VOLTS = 0.5
"""Of a voltage in one byte."""

TORQUE_MARK, DAMPING_MARK = 1234.5, 4321.25
"""Where the library puts these, our numbers go."""


class _Asked(QueryResolution):
    mode, position, q_current, voltage, temperature, fault = INT8, F32, F32, INT8, INT8, INT8
    velocity = torque = IGNORE


class _Told(PositionResolution):
    """Short where only 0, -1 and "none" are said: 48 bytes a frame instead of 64."""

    position = velocity = kp_scale = velocity_limit = accel_limit = ilimit_scale = INT8


QUESTION = bytes(Controller(query_resolution=_Asked()).make_query().data)
HEADS = tuple(bytes((QUESTION[k] + REPLIES, QUESTION[k + 1])) for k in range(0, len(QUESTION), 2))


class MoteusAnswer(NamedTuple):
    """Of one moteus, by its own account."""

    mode: int
    turns: float
    """Of its output."""
    current_A: float
    """Of the torque-giving axis."""
    supply_V: float
    temperature_C: float
    """Of its board."""
    code: int
    """A fault in mode 1; else what limits it."""


def answer(data: bytes) -> MoteusAnswer | None:
    """What these bytes say; None where they are no answer to `QUESTION`, or it has no position or current."""
    said = None
    if len(data) >= ANSWER.size:
        a, mode, b, turns, c, current, d, halves, celsius, code = ANSWER.unpack_from(data)
        if (a, b, c, d) == HEADS:
            said = MoteusAnswer(mode, turns, current, VOLTS * halves, float(celsius), code)
    said = said or _by_library(data)
    return said if said is not None and math.isfinite(said.turns) and math.isfinite(said.current_A) else None


def _by_library(data: bytes) -> MoteusAnswer | None:
    """Of a drive that puts its registers otherwise."""
    asked = (
        Register.MODE, Register.POSITION, Register.Q_CURRENT, Register.VOLTAGE, Register.TEMPERATURE, Register.FAULT
    )  # fmt: skip
    try:
        found = parse_registers(data).response
        mode, turns, current, supply, temperature, code = (found[register] for register in asked)
    except (KeyError, RuntimeError, ValueError, struct.error):
        return None
    return MoteusAnswer(int(mode), turns, current, supply, float(temperature), int(code))


class CommandLines:
    """Lines that command one moteus."""

    def __init__(self, number: int, source: int, torque_max_Nm: float, watchdog_s: float):
        """Of this number, from us.

        Args:
            number: Of the drive.
            source: Ours.
            torque_max_Nm: It gives no more, whatever damping asks [N·m].
            watchdog_s: After which each command is void [s].
        """
        if not 0.0 < watchdog_s < math.inf:
            raise ValueError("a moteus takes 0 as its own default and no number as for ever")
        controller = Controller(id=number, position_resolution=_Told())
        told = controller.make_position(
            position=math.nan, velocity=0.0, feedforward_torque=TORQUE_MARK, kp_scale=0.0, kd_scale=DAMPING_MARK,
            maximum_torque=torque_max_Nm, watchdog_timeout=watchdog_s, velocity_limit=-1.0, accel_limit=-1.0,
            ilimit_scale=0.0,
        )  # fmt: skip
        self._head, self._torque = head(number, source, wants_answer=False), bytearray(told.data)
        self._torque_at = self._torque.index(FLOAT.pack(TORQUE_MARK))
        self._damping_at = self._torque.index(FLOAT.pack(DAMPING_MARK))
        self.brake = line(self._head, controller.make_brake().data)
        """Short its windings."""
        self.stop = line(self._head, controller.make_stop().data)
        """Let go, and forget its fault."""

    def torque(self, torque_Nm: float, kd_scale: float) -> bytes:
        """Give this much, and brake with so many times its own kd besides."""
        FLOAT.pack_into(self._torque, self._torque_at, torque_Nm)
        FLOAT.pack_into(self._torque, self._damping_at, kd_scale)
        return line(self._head, self._torque)
