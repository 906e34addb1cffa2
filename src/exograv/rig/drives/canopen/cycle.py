"""Frames of one period on a CANopen bus: a SYNC, each drive's answer, and a command to each drive."""

import struct
from collections.abc import Sequence

from exograv.rig.drives.bus_load import frame_bits
from exograv.rig.drives.cycle import Cycle
from exograv.rig.drives.settings import Drives

from . import objects as at
from .bus import Bus, CanFrame
from .node import CanopenNode
from .objects import MASTER, CobId, Nmt

FORGET_US = struct.Struct("<BHBI").pack(0x23, at.HEARTBEAT_WATCHED.index, at.HEARTBEAT_WATCHED.sub, 0)
"""SDO request that disables the watched heartbeat. Its answer is not awaited, because the host is leaving."""

OUR_HEARTBEAT = bytes([Nmt.OPERATIONAL])

BEATS_PER_WATCHDOG = 4
"""Number of our heartbeats per watchdog time; three of them may be lost."""

BITRATE = 1_000_000
"""Bit rate if the file has none: the highest of CiA 301 [bit/s]."""


class CanopenCycle(Cycle[CanFrame, CanopenNode]):
    """Frames of one machine. Our heartbeat is sent with the commands, so a drive without commands gets no heartbeat."""

    def __init__(self, bus: Bus, nodes: Sequence[CanopenNode], drives: Drives):
        super().__init__(bus, nodes)
        self._bus, self._told = bus, 0
        self._beat_every = max(int(drives.watchdog_s / BEATS_PER_WATCHDOG / drives.period_s), 1)
        self._handlers = {
            kind + node.drive.node: handler for node in self._nodes for kind, handler in node.handlers.items()
        }
        to_each = {kind + node.drive.node for node in nodes for kind in (CobId.COMMAND, CobId.QUESTION)}
        self._hosts = frozenset({CobId.NMT, CobId.SYNC, CobId.HEARTBEAT + MASTER} | to_each)
        """Frames that only a host of these drives sends."""

    def tell(self, orders: Sequence[bytes]) -> None:
        """Send one command to each drive, and the heartbeat of this computer."""
        for node, data in zip(self._nodes, orders, strict=True):
            self._bus.send(CobId.COMMAND + node.drive.node, data)
        if self._told % self._beat_every == 0:
            self._bus.send(CobId.HEARTBEAT + MASTER, OUR_HEARTBEAT)
        self._told += 1

    def order(self, command: int, nodes: Sequence[CanopenNode]) -> None:
        """Change the NMT state of these drives."""
        for node in nodes:
            self._bus.send(CobId.NMT, bytes([command, node.drive.node]))

    def leave(self) -> None:
        """Disable the drives' watch on our heartbeat, and set them pre-operational."""
        for node in self._nodes:
            self._bus.send(CobId.QUESTION + node.drive.node, FORGET_US)
        self.order(Nmt.PRE_OPERATIONAL, self._nodes)

    def _send_question(self) -> None:
        self._bus.send(CobId.SYNC, b"")

    def _is_of_another_host(self, frame: CanFrame) -> bool:
        return frame.cob in self._hosts

    def _take(self, frame: CanFrame) -> None:
        if (handler := self._handlers.get(frame.cob)) is not None:
            handler(frame.data)


def answer_bits(drives: Drives) -> int:
    """Return the number of bits from the SYNC to the last drive's answer."""
    measured = frame_bits(at.layout(at.MEASURED).size)
    motor = 0 if drives.rad_per_motor_count is None else frame_bits(at.layout(at.MOTOR).size)
    return frame_bits(0) + len(drives.each) * (measured + motor)


def load(drives: Drives) -> float:
    """Share of the wire's time that one period of this machine takes [-]; above 1 it does not fit."""
    command = frame_bits(at.layout((*at.COMMAND, at.DAMPING)).size)
    slow = frame_bits(at.layout(at.SLOW).size) / at.SLOW_SYNCS
    bits = answer_bits(drives) + len(drives.each) * (command + slow)
    # The load counts our heartbeat with every second command, and each drive's heartbeat once per watchdog time.
    beats = frame_bits(1) * (0.5 + len(drives.each) * drives.period_s / drives.watchdog_s)
    bus = drives.settings.canopen
    bitrate = BITRATE if bus is None or bus.bitrate is None else bus.bitrate
    return (bits + beats) / (bitrate * drives.period_s)
