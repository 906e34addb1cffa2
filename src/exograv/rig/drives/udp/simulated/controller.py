"""A simulated controller that speaks `docs/udp_protocol.md`, with a twin's motors behind its drives."""

import contextlib
import select
import socket
import time
from collections.abc import Callable, Iterator
from typing import Any

from exograv.errors import RigError
from exograv.rig.drive_status import DriveFault
from exograv.rig.drives.settings import Drives
from exograv.rig.drives.simulated.firmware import SimulatedDrive
from exograv.rig.drives.simulated.plant import Plant
from exograv.rig.drives.udp.layout import SEQUENCES, DriveFlag, Flag, Type
from exograv.rig.drives.udp.packets import (
    Packet,
    Refusal,
    RefusedError,
    decode,
    encode,
    name_bytes,
    refuse_wrong_command,
)

from .session import Address, UdpSession

STATES = 32
"""Of which a command may still answer one."""

STALL_S = 0.005
"""A pause of this process from which on its clock is set anew: real drives do not pause, so their time stands still."""

LOCK_STEP_HOLD_S = 2.0
"""After which a silent host has let go of a machine that waits for it."""

AT_ONCE = 64
"""Packets between two steps; who sends more does not keep the drives from their watchdogs."""

BUFFER = 2048


class UdpController:
    """Answers one host; its drives watch, limit and brake by themselves whatever it is told."""

    def __init__(self, plant: Plant, drives: Drives, lock_step: bool = False, say: Callable[[str], None] = print):
        """Listen at the address of `drives.toml`, and at no other.

        Args:
            plant: Behind the drives.
            drives: With a controller as their bus.
            lock_step: Step the plant by one period of the loop with each poll, and not by the clock.
            say: Told what happens, a line an event.

        Raises:
            RigError: The address is not this computer's, or in use.
        """
        self._plant, self._drives, self._lock_step, self._say = plant, drives, lock_step, say
        # In lock-step the wall clock says nothing: a host may think for as long as it wants.
        self.session = UdpSession(len(drives.joints), LOCK_STEP_HOLD_S if lock_step else drives.watchdog_s)
        self._present = [True] * len(drives.joints)
        self._is_cut = self._was_enabled = False
        self._command, self._state = 0, 0
        self._states: list[tuple[int, float]] = [(-1, 0.0)] * STATES
        self._socket = _listening(drives)
        self._faults = [DriveFault.NONE] * len(drives.joints)

    @property
    def where(self) -> str:
        """Its address, for people."""
        host, port = self._socket.getsockname()
        return f"udp://{host}:{port}"

    def unplug(self, joint: int) -> None:
        """Its drive is not heard any more, and hears nothing."""
        self._present[joint] = False

    def plug(self, joint: int) -> None:
        """It is heard again."""
        self._present[joint] = True

    def cut(self) -> None:
        """The cable to the host is out."""
        self._is_cut = True

    def mend(self) -> None:
        """It is in again; what was sent meanwhile is gone."""
        self._drain()
        self._is_cut = False

    def run(self, until_stopped: Callable[[], bool]) -> None:
        """Serve until then, asked at least a hundred times a second."""
        if not self._lock_step:
            self._run_by_clock(until_stopped)
            return
        while not until_stopped():
            self._wait(0.01)

    def __enter__(self) -> "UdpController":
        return self

    def __exit__(self, *_: object) -> None:
        """Let go of the address."""
        self._socket.close()

    def receive(self, data: bytes, sender: Address, now: float) -> bytes | None:
        """One packet; what is answered, never more bytes than came.

        Args:
            data: As it came.
            sender: From where.
            now: On a clock that never goes back [s].
        """
        try:
            packet = decode(data)
            return self._act(packet, sender, now)
        except RefusedError as refused:
            self.session.refused[refused.why.value] += 1
            return None

    def _act(self, packet: Packet, sender: Address, now: float) -> bytes | None:
        kind = packet.header.kind
        if kind is Type.HELLO:
            return self._nameplate(packet, self._greeted(packet, sender, now))
        self.session.check(packet, sender)
        if kind is Type.POLL:
            self.session.accept(packet, now)
            return self._answer_poll(packet)
        if kind is Type.COMMAND:
            self._obey(packet, now)
        elif kind is Type.BYE:
            self._all_off()
            self.session.end()
            self._say("The host has said goodbye.")
        else:
            raise RefusedError(Refusal.TYPE)
        return None

    def _greeted(self, packet: Packet, sender: Address, now: float) -> Flag:
        flags = self.session.greet(packet, sender, now)
        if flags is Flag.NONE:
            self._all_off()
            self._say(f"Host {sender[0]}:{sender[1]} has the controller.")
        return flags

    def _all_off(self) -> None:
        self._was_enabled, self._command = False, 0
        self._states = [(-1, 0.0)] * STATES
        for drive in self._heard():
            drive.disable()

    def _heard(self) -> Iterator[SimulatedDrive]:
        return (drive for drive, is_there in zip(self._plant.each, self._present, strict=True) if is_there)

    def _obey(self, packet: Packet, now: float) -> None:
        refuse_wrong_command(packet)
        header, plant = packet.header, self._plant
        wants = Flag(header.flags & (Flag.ENABLE | Flag.ACKNOWLEDGE))
        until = self._until(packet) if wants else plant.now
        self.session.accept(packet, now)
        self._command = header.sequence
        if not wants & Flag.ENABLE:
            for drive in self._heard():
                drive.disable()
                if wants:
                    drive.acknowledge()
        elif not self._was_enabled:
            for drive in self._heard():
                drive.enable(plant.now)
        else:
            self._tell(packet, until)
        self._was_enabled = bool(wants & Flag.ENABLE)

    def _until(self, packet: Packet) -> float:
        """When the life of a command ends, on the plant's clock [s].

        Raises:
            RefusedError: It has ended, or the state that it answers is forgotten.
        """
        age_us, life_us = packet.own
        number, at = self._states[packet.header.answers % STATES]
        now = self._plant.now
        until = min(at + 1e-6 * age_us, now) + 1e-6 * life_us
        if number != packet.header.answers or until <= now:
            raise RefusedError(Refusal.DEAD)
        return until

    def _tell(self, packet: Packet, until: float) -> None:
        told = packet.joints
        for joint, drive in enumerate(self._plant.each):
            if self._present[joint]:
                drive.tell(told[2 * joint], told[2 * joint + 1], self._plant.now, until)

    def _nameplate(self, packet: Packet, flags: Flag) -> bytes:
        drives, joints = self._drives, []
        for drive in drives.each:
            joints += [
                name_bytes(drive.joint), drive.current_rated_A, drive.current_max_A, drive.brake_Nms_per_rad, 0
            ]  # fmt: skip
        own = (round(1e6 * drives.watchdog_s), round(1e6 * drives.period_s))
        return encode(self.session.answer(Type.NAMEPLATE, packet, time.monotonic_ns(), flags), own, tuple(joints))

    def _answer_poll(self, packet: Packet) -> bytes:
        if self._lock_step:
            self._step_loop()
        header = self.session.answer(Type.STATE, packet, time.monotonic_ns())
        self._states[header.sequence % STATES] = header.sequence, self._plant.now
        own = (self._command, sum(self.session.refused.values()) % SEQUENCES)
        return encode(header, own, self._said())

    def _said(self) -> tuple[Any, ...]:
        plant, said = self._plant, []
        has_motor = plant.measured.q_motor is not None
        for joint, drive in enumerate(plant.each):
            motor = plant.motor_position(joint) if has_motor else float("nan")
            flags = DriveFlag.ENABLED if drive.is_enabled else DriveFlag.NONE
            fault = drive.fault
            if self._present[joint]:
                flags |= DriveFlag.PRESENT
            else:
                flags, fault = DriveFlag.NONE, DriveFault.LOST
            status = (drive.temperature_C, int(flags), int(fault), 0, 0)
            said += [plant.position(joint), motor, plant.current(joint), *status]
        return tuple(said)

    def _step_loop(self) -> None:
        for _ in range(round(self._drives.period_s / self._plant.twin.period_s)):
            self._step()

    def _step(self) -> None:
        at = self._plant.now
        self._plant.step()
        faults = [drive.fault for drive in self._plant.each]
        if faults != self._faults:
            for joint, drive, before in zip(self._drives.joints, self._plant.each, self._faults, strict=True):
                if drive.fault != before:
                    said = drive.fault.name or "no fault"
                    self._say(f"{at:.3f} s: {joint}: {said}; told last {1e3 * (at - drive.told_at):.1f} ms before")
            self._faults = faults

    def _run_by_clock(self, until_stopped: Callable[[], bool]) -> None:
        period = self._plant.twin.period_s
        due = time.monotonic() + period
        while not until_stopped():
            while (left := due - time.monotonic()) > 0.0:
                self._wait(left)
            if left < -STALL_S:
                due -= left
            self._drain()  # what was told meanwhile is heard before any time passes here
            self._step()
            due += period

    def _wait(self, seconds: float) -> None:
        """Serve whoever speaks within that time; at least once."""
        if select.select((self._socket,), (), (), seconds)[0]:
            self._drain()

    def _drain(self) -> None:
        for _ in range(AT_ONCE):
            try:
                data, sender = self._socket.recvfrom(BUFFER)
            except BlockingIOError:
                return
            except OSError:  # an answer found nobody
                continue
            if self._is_cut:
                self._miss(data)
                continue
            answer = self.receive(data, sender, time.monotonic())
            if answer is not None:
                self._send(answer, sender)

    def _miss(self, data: bytes) -> None:
        """In lock-step a poll is also the clock, and time goes on though its cable is out."""
        with contextlib.suppress(RefusedError):
            if self._lock_step and decode(data).header.kind is Type.POLL:
                self._step_loop()

    def _send(self, answer: bytes, sender: Address) -> None:
        try:
            self._socket.sendto(answer, sender)
        except OSError:  # no room, or nobody there: as if it was lost on the way
            self.session.refused["not sent"] += 1


def _listening(drives: Drives) -> socket.socket:
    udp = drives.settings.udp
    if udp is None:
        raise RigError("drives.toml names no controller: [udp] with host and port is missing. Add it there.")
    made = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    made.setblocking(False)
    try:
        made.bind((udp.host, udp.port))
    except OSError as error:
        made.close()
        raise RigError(
            f"udp.host {udp.host}, port {udp.port} cannot be listened at: {error.strerror}. Give this computer's own "
            "address and a free port in drives.toml."
        ) from error
    return made
