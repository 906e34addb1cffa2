"""What goes over the bus in one period: a SYNC, each drive's answer, and a command to each."""

import struct
import time
from collections.abc import Callable, Sequence

from exograv.rig.drive_status import DriveFault

from . import objects as at
from .bus import Bus, CanFrame
from .node import CanopenNode
from .objects import MASTER, Cob, Nmt

TOLD, TOLD_DAMPED = at.layout(at.COMMAND), at.layout((*at.COMMAND, at.DAMPING))
FORGET_US = struct.Struct("<BHBI").pack(0x23, at.HEARTBEAT_WATCHED.index, at.HEARTBEAT_WATCHED.sub, 0)
"""A question that sets the watched heartbeat to none; nobody waits for the answer, because we are leaving."""
OUR_HEARTBEAT = bytes([Nmt.OPERATIONAL])


class CanopenCycle:
    """Of one machine."""

    def __init__(self, bus: Bus, nodes: Sequence[CanopenNode], beat_every: int):
        """Nothing is sent.

        Args:
            bus: With all drives.
            nodes: In the order of the joints.
            beat_every: Commands between two of our heartbeats.
        """
        self._bus, self._nodes = bus, tuple(nodes)
        self._beat_every, self._told = beat_every, 0
        self.late = 0
        """Frames that came when their SYNC's time was over."""
        self._handlers = _handlers(nodes)
        self._masters = masters_frames([node.drive.node for node in nodes])

    def ask(self, answer_s: float) -> bool:
        """One SYNC; whether every drive that is not lost has answered to it within so long [s]."""
        self.late += self.listen()
        for node in self._nodes:
            node.ask()
        until = time.monotonic() + answer_s
        self._bus.send(Cob.SYNC, b"")
        while not (is_complete := self._is_complete()):
            frame = self._bus.receive(until - time.monotonic())
            if frame is None:
                break
            self._hear(frame)
        for node in self._nodes:
            node.close()
        return is_complete

    def tell(self, per_mille: Sequence[int], damping: Sequence[int]) -> None:
        """One command to each drive, and by it the sign that we live: who is told nothing hears no heartbeat either.

        Args:
            per_mille: Of each rated current; a drive that is not wanted is told none.
            damping: [mN·m·s/rad]
        """
        for node, told, brakes in zip(self._nodes, per_mille, damping, strict=True):
            target = told if node.is_wanted and not node.fault else 0
            if node.has_damping:
                data = TOLD_DAMPED.pack(node.control, target, brakes)
            else:
                data = TOLD.pack(node.control, target)
            self._bus.send(Cob.COMMAND + node.drive.node, data)
        if self._told % self._beat_every == 0:
            self._bus.send(Cob.HEARTBEAT + MASTER, OUR_HEARTBEAT)
        self._told += 1

    def listen(self, seconds: float = 0.0) -> int:
        """Take what is on the bus, waiting so long for more; how many frames of drives there were."""
        until, frames = time.monotonic() + seconds, 0
        while (frame := self._bus.receive(until - time.monotonic())) is not None:
            frames += self._hear(frame)
        return frames

    def order(self, command: int, nodes: Sequence[CanopenNode]) -> None:
        """Change the NMT state of these."""
        for node in nodes:
            self._bus.send(Cob.NMT, bytes([command, node.drive.node]))

    def leave(self) -> None:
        """Drives no longer expect us, and fall silent."""
        for node in self._nodes:
            self._bus.send(Cob.QUESTION + node.drive.node, FORGET_US)
        self.order(Nmt.PRE_OPERATIONAL, self._nodes)

    def _is_complete(self) -> bool:
        return all(node.has_answered or node.is_lost for node in self._nodes)

    def _hear(self, frame: CanFrame) -> bool:
        """Whether it is a drive's measurement."""
        if (handler := self._handlers.get(frame.cob)) is not None:
            handler(frame.data)
            return Cob.MEASURED < frame.cob < Cob.SLOW
        if frame.cob in self._masters:
            for node in self._nodes:
                node.hold_against(DriveFault.OTHER_MASTER)
        return False


def masters_frames(nodes: Sequence[int]) -> frozenset[int]:
    """Frames that only who commands these drives sends."""
    to_each = {kind + node for node in nodes for kind in (Cob.COMMAND, Cob.QUESTION)}
    return frozenset({Cob.NMT, Cob.SYNC, Cob.HEARTBEAT + MASTER} | to_each)


def _handlers(nodes: Sequence[CanopenNode]) -> dict[int, Callable[[bytes], None]]:
    found = {}
    for node in nodes:
        number = node.drive.node
        found[Cob.EMERGENCY + number] = node.on_emergency
        found[Cob.MEASURED + number] = node.on_measured
        found[Cob.MOTOR + number] = node.on_motor
        found[Cob.SLOW + number] = node.on_slow
        found[Cob.HEARTBEAT + number] = node.on_heartbeat
    return found
