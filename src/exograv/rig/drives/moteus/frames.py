"""Commands to a moteus and its answers, encoded once by the maker's library and filled in at every tick.

The library needs some 45 µs to encode one command, and as long to decode one answer. A machine needs several of each
per tick.
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
"""Difference between the first byte of a question and that of its answer."""

VOLTS = 0.5
"""Unit of a voltage in one byte [V]."""

TORQUE_MARK, DAMPING_MARK = 1234.5, 4321.25
"""Placeholders that mark the bytes of torque and damping in the library's frame."""


class _Asked(QueryResolution):
    mode, position, q_current, voltage, temperature, fault = INT8, F32, F32, INT8, INT8, INT8
    velocity = torque = IGNORE


class _Told(PositionResolution):
    """Resolution of a command: one byte for fields that only hold 0, -1 or "none".

    A frame then has 48 bytes in place of 64.
    """

    position = velocity = kp_scale = velocity_limit = accel_limit = ilimit_scale = INT8


QUESTION = bytes(Controller(query_resolution=_Asked()).make_query().data)
HEADS = tuple(bytes((QUESTION[k] + REPLIES, QUESTION[k + 1])) for k in range(0, len(QUESTION), 2))


class MoteusAnswer(NamedTuple):
    """Report of one moteus."""

    mode: int
    turns: float
    """Position of its output [turns]."""
    current_A: float
    """Current of the torque-giving axis."""
    supply_V: float
    temperature_C: float
    """Temperature of its board."""
    code: int
    """Fault in mode 1; otherwise the reason for a limit."""


def answer(data: bytes) -> MoteusAnswer | None:
    """Return the content of an answer to `QUESTION`; None for other bytes, or if position or current is missing."""
    said = None
    if len(data) >= ANSWER.size:
        a, mode, b, turns, c, current, d, halves, celsius, code = ANSWER.unpack_from(data)
        if (a, b, c, d) == HEADS:
            said = MoteusAnswer(mode, turns, current, VOLTS * halves, float(celsius), code)
    said = said or _by_library(data)
    return said if said is not None and math.isfinite(said.turns) and math.isfinite(said.current_A) else None


def _by_library(data: bytes) -> MoteusAnswer | None:
    """Decode the answer of a drive that orders its registers in another way."""
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
        """Encode the commands to the drive of this number.

        Args:
            number: Node number of the drive.
            source: Node number of the host.
            torque_max_Nm: Limit of the drive's torque, damping included [N·m].
            watchdog_s: Life of each command [s].
        """
        if not 0.0 < watchdog_s < math.inf:
            raise ValueError(
                "watchdog_s must be positive and finite: a moteus takes 0 as its own default, and NaN as no time-out"
            )
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
        """Line that shorts the windings."""
        self.stop = line(self._head, controller.make_stop().data)
        """Line that lets the motor go and clears its fault."""

    def torque(self, torque_Nm: float, kd_scale: float) -> bytes:
        """Line that commands a torque [N·m], and damping with `kd_scale` times the drive's own kd."""
        FLOAT.pack_into(self._torque, self._torque_at, torque_Nm)
        FLOAT.pack_into(self._torque, self._damping_at, kd_scale)
        return line(self._head, self._torque)
