"""Scripted worlds whose drives are on UDP and on CAN."""

import secrets
import struct
from collections import Counter
from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest

from exograv.live.native_buses import CANOPEN, UDP
from exograv.rig.drives.canopen.bus import Bus, CanFrame
from exograv.rig.drives.canopen.objects import CobId
from exograv.rig.drives.canopen.rig import CanopenRig
from exograv.rig.drives.canopen.states import ENABLE
from exograv.rig.drives.settings import Drives
from exograv.rig.drives.udp.host import UdpRig
from exograv.rig.drives.udp.layout import DriveFlag, Type
from exograv.rig.drives.udp.packets import Header, decode, encode

from .scripted_world import ABSENT, CORRUPT, FAULT, JOINTS, LATE, LOST, NO_MOTOR, NOT_A_NUMBER, OFF, TWICE, World

SESSION, GRANT = 77, 99


@dataclass
class UdpWorld(World):
    """Drives on UDP: they answer a poll after 50 µs."""

    number: int = 0
    command: int = 0
    example, bus = "udp.toml", UDP

    def machine(self, drives: Drives) -> UdpRig:
        rig = UdpRig(drives)
        link = rig._link
        link._socket, link._session, link._grant = FakeSocket(self), SESSION, GRANT  # type: ignore[assignment]
        rig.read()
        rig._is_on = True
        return rig

    def use(self, patch: pytest.MonkeyPatch) -> None:
        super().use(patch)
        patch.setattr("exograv.rig.drives.udp.link.select", FakeSocket(self))
        patch.setattr(secrets, "randbelow", lambda _most: SESSION - 1)

    def sent_by_c(self, data: bytes) -> int:
        return self.send(data)

    def received_by_c(self, until_ns: int) -> bytes | None:
        return self.arriving(until_ns)

    def send(self, data: bytes) -> int:
        """Take a packet of the loop."""
        self.sent.append(data)
        packet = decode(data)
        if packet.header.kind is Type.COMMAND:
            self.command, self.currents = packet.header.sequence, np.array(packet.joints[::2])
        elif packet.header.kind is Type.POLL:
            self._answer(packet.header)
        return len(data)

    def _answer(self, asked: Header) -> None:
        what, k = self.script.drives[self.tick], self.tick
        self.number += 1
        status, fault = DriveFlag.ENABLED | DriveFlag.PRESENT, 0
        joints = list[float]()
        for j in range(JOINTS):
            is_odd = j == 1
            q = float("nan") if what == NOT_A_NUMBER and is_odd else self.script.q[k, j]
            motor = float("nan") if what == NO_MOTOR else self.script.q[k, j] + 1e-4
            of_joint = DriveFlag.ENABLED if what == ABSENT and is_odd else status
            of_joint = DriveFlag.PRESENT if what == OFF and is_odd else of_joint
            fault = 4 if what == FAULT and is_odd else 0
            joints += [q, motor, self.currents[j], 30.0, int(of_joint), fault, 7 if fault else 0, 0]
        header = Header(Type.STATE, JOINTS, 0, SESSION, GRANT, self.number, asked.sequence, self.now)
        data = encode(header, (self.command, 0), tuple(joints))
        if what == CORRUPT:
            data = data[:50] + bytes([data[50] ^ 1]) + data[51:]
        if what != LOST:
            at = self.now + (1_000_000 if what == LATE else 50_000)
            self.arrivals += [(at, data)] * (2 if what == TWICE else 1)


class FakeSocket:
    """Socket of the Python driver in this world."""

    def __init__(self, world: UdpWorld):
        self._world = world

    def send(self, data: bytes) -> int:
        return self._world.send(data)

    def recv(self, _size: int) -> bytes:
        world = self._world
        if world.arrivals and world.arrivals[0][0] <= world.now:
            return world.arrivals.pop(0)[1]
        raise BlockingIOError

    def fileno(self) -> int:
        return -1

    def close(self) -> None:
        pass

    def select(self, _read: object, _write: object, _errors: object, seconds: float) -> tuple[list[int], None, None]:
        """Wait as `select.select`: time passes until the next packet, or until the time is over."""
        world, until = self._world, self._world.now + round(1e9 * seconds)
        comes = bool(world.arrivals) and world.arrivals[0][0] <= until
        world.now = max(world.now, world.arrivals[0][0] if comes else until)
        return ([1] if comes else []), None, None


CAN_FRAME = struct.Struct("<IBBBB8s")
"""Frame of SocketCAN."""
STATUS_ON, STATUS_OFF, STATUS_FAULT = 0x27, 0x40, 0x08
EMERGENCY_SHORT = struct.pack("<HB5x", 0x2310, 1)


class Wire(Bus):
    """CAN bus of a world."""

    def __init__(self, world: "CanWorld"):
        self._world, self.counts, self._mark = world, Counter(), None
        self.adapter: Any = type("Adapter", (), {"socket": type("Socket", (), {"fileno": lambda _: -1})()})

    def receive(self, until: float) -> CanFrame | None:
        return self._world.arriving(round(1e9 * until))

    def send(self, cob: int, data: bytes) -> None:
        self._world.take(cob, bytes(data))

    def close(self) -> None:
        pass


@dataclass
class CanWorld(World):
    """Drives on CAN: each answers a SYNC with two frames, 50 to 400 µs after it."""

    example, bus = "canopen.toml", CANOPEN

    def machine(self, drives: Drives) -> CanopenRig:
        rig = CanopenRig(drives)
        link = Wire(self)
        rig._link, rig._cycle = link, rig._cycle_on(link)
        self._per_count = (drives.sign * drives.rad_per_count).tolist()
        assert drives.rad_per_motor_count is not None
        self._per_motor_count = (drives.sign * drives.rad_per_motor_count).tolist()
        self._offset = drives.offset.tolist()
        for node in rig._nodes:
            node.is_wanted, node.control, node.has_damping = True, ENABLE, True
        rig.read()
        rig._is_on = True
        return rig

    def sent_by_c(self, data: bytes) -> int:
        cob, length, _, _, _, body = CAN_FRAME.unpack(data)
        self.take(cob, body[:length])
        return len(data)

    def received_by_c(self, until_ns: int) -> bytes | None:
        frame = self.arriving(until_ns)
        return None if frame is None else CAN_FRAME.pack(frame.cob, len(frame.data), 0, 0, 0, frame.data)

    def take(self, cob: int, data: bytes) -> None:
        """Take a frame of the loop."""
        self.sent.append((cob, data))
        if CobId.COMMAND < cob <= CobId.COMMAND + JOINTS:
            self.currents[cob - CobId.COMMAND - 1] = struct.unpack_from("<h", data, 2)[0]
        elif cob == CobId.SYNC:
            for joint in range(JOINTS):
                self._answer(joint)
            self.arrivals.sort(key=lambda one: one[0])

    def _answer(self, joint: int) -> None:
        what, k = self.script.drives[self.tick], self.tick
        is_odd, node = joint == 1, joint + 1
        word = STATUS_OFF if what == OFF and is_odd else STATUS_FAULT if what == FAULT and is_odd else STATUS_ON
        q = self.script.q[k, joint] - self._offset[joint]
        current = int(self.currents[joint]) if np.isfinite(self.currents[joint]) else 0
        body = struct.pack("<Hih", word, round(q / self._per_count[joint]), current)
        motor = struct.pack("<i", round((q + 1e-4) / self._per_motor_count[joint]))
        at = self.now + 50_000 + 90_000 * joint + (2_000_000 if what == LATE else 0)
        frames = [CanFrame(CobId.MEASURED + node, body), CanFrame(CobId.MOTOR + node, motor)]
        if what == CORRUPT:
            frames[0] = CanFrame(frames[0].cob, body[:5])
        if what == NO_MOTOR:
            frames = frames[:1]
        if what == FAULT and is_odd:
            frames.insert(0, CanFrame(CobId.EMERGENCY + node, EMERGENCY_SHORT))
        if what != LOST and not (what == ABSENT and is_odd):
            self.arrivals += [(at + 10_000 * n, frame) for n, frame in enumerate(frames)] * (2 if what == TWICE else 1)
