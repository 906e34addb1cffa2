"""Simulated controller with the protocol of `docs/reference/udp_protocol.md` and the motors of a twin."""

import contextlib
import select
import socket
import time
from collections.abc import Iterator
from typing import Any

from exograv.errors import RigError
from exograv.rig.drive_status import DriveFault
from exograv.rig.drives.settings import Drives, UdpBus
from exograv.rig.drives.simulated.devices import AT_ONCE, Say, SimulatedDevices
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

SAMPLES = 2**16
"""Number of samples after which the sample counter in a STATE packet returns to 0."""

STATES = 32
"""Number of past states that a command may answer."""

LOCK_STEP_HOLD_S = 2.0
"""Time after which a silent host loses a machine in lock-step [s]."""

BUFFER = 2048


class UdpController(SimulatedDevices):
    """Controller of one host. Its drives have their own watchdogs, limits and brakes, independent of their commands."""

    def __init__(self, plant: Plant, drives: Drives, lock_step: bool = False, say: Say = print):
        """Listen at the address of `drives.toml` only.

        Raises:
            ConfigError: The drives are on another bus.
            RigError: The address does not belong to this computer, or is in use.
        """
        super().__init__(plant, drives, lock_step, say)
        # In lock-step the wall clock has no meaning: a host may compute for as long as it wants.
        self.session = UdpSession(len(drives.joints), LOCK_STEP_HOLD_S if lock_step else drives.watchdog_s)
        self._was_enabled = False
        self._command = 0
        self._states: list[tuple[int, float]] = [(-1, 0.0)] * STATES
        self._socket = _listening(drives.table(UdpBus))

    @property
    def where(self) -> str:
        """Address of the bus in readable form."""
        host, port = self._socket.getsockname()
        return f"udp://{host}:{port}"

    def receive(self, data: bytes, sender: Address, now: float) -> bytes | None:
        """Process one packet; return the answer, which never has more bytes than the packet.

        Args:
            data: Bytes of the packet.
            sender: Address of its sender.
            now: Time on a clock that never goes back [s].
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
            self._say("The host has ended the session.")
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
        return (drive for joint, drive in enumerate(self.plant.each) if joint not in self._unplugged)

    def _obey(self, packet: Packet, now: float) -> None:
        refuse_wrong_command(packet)
        header, plant = packet.header, self.plant
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
        """End of the life of a command on the plant's clock [s].

        Raises:
            RefusedError: The command has expired, or the state that it answers is forgotten.
        """
        age_us, life_us = packet.own
        number, at = self._states[packet.header.answers % STATES]
        now = self.plant.now
        until = min(at + 1e-6 * age_us, now) + 1e-6 * life_us
        if number != packet.header.answers or until <= now:
            raise RefusedError(Refusal.DEAD)
        return until

    def _tell(self, packet: Packet, until: float) -> None:
        told = packet.joints
        for joint, drive in enumerate(self.plant.each):
            if joint not in self._unplugged:
                drive.tell(told[2 * joint], told[2 * joint + 1], self.plant.now, until)

    def _nameplate(self, packet: Packet, flags: Flag) -> bytes:
        drives, joints = self._drives, []
        for drive in drives.each:
            joints += [
                name_bytes(drive.joint), drive.current_rated_A, drive.current_max_A, drive.brake_Nms_per_rad, 1
            ]  # fmt: skip
        own = (round(1e6 * drives.watchdog_s), round(1e6 * drives.period_s))
        return encode(self.session.answer(Type.NAMEPLATE, packet, time.monotonic_ns(), flags), own, tuple(joints))

    def _answer_poll(self, packet: Packet) -> bytes:
        self._note_question()
        if self._lock_step:
            self._step_loop()
        header = self.session.answer(Type.STATE, packet, time.monotonic_ns())
        self._states[header.sequence % STATES] = header.sequence, self.plant.now
        own = (self._command, sum(self.session.refused.values()) % SEQUENCES)
        return encode(header, own, self._said())

    def _said(self) -> tuple[Any, ...]:
        plant, said = self.plant, []
        has_motor = plant.measured.q_motor is not None
        for joint, drive in enumerate(plant.each):
            motor = plant.motor_position(joint) if has_motor else float("nan")
            flags = DriveFlag.ENABLED if drive.is_enabled else DriveFlag.NONE
            fault = drive.fault
            if joint not in self._unplugged:
                flags |= DriveFlag.PRESENT
            else:
                flags, fault = DriveFlag.NONE, DriveFault.LOST
            status = (drive.temperature_C, int(flags), int(fault), 0, plant.sample(joint) % SAMPLES)
            said += [plant.position(joint), motor, plant.current(joint), *status]
        return tuple(said)

    def _close(self) -> None:
        self._socket.close()

    def _step_drive(self, joint: int) -> None:
        """Do nothing: a drive on this bus has no behaviour beside its firmware."""

    def _serve(self, seconds: float) -> None:
        if select.select((self._socket,), (), (), seconds)[0]:
            self._drain()

    def _drain(self) -> None:
        for _ in range(AT_ONCE):
            try:
                data, sender = self._socket.recvfrom(BUFFER)
            except BlockingIOError:
                return
            except OSError:  # an answer found no receiver
                continue
            if self._is_cut:
                self._miss(data)
                continue
            answer = self.receive(data, sender, time.monotonic())
            if answer is not None:
                self._send(answer, sender)

    def _miss(self, data: bytes) -> None:
        """Advance time in lock-step with a poll that is lost: a poll is also the clock, even without a cable."""
        with contextlib.suppress(RefusedError):
            if self._lock_step and decode(data).header.kind is Type.POLL:
                self._step_loop()

    def _send(self, answer: bytes, sender: Address) -> None:
        try:
            self._socket.sendto(answer, sender)
        except OSError:  # a full buffer, or no receiver: the same as a lost packet
            self.session.refused["not sent"] += 1


def _listening(udp: UdpBus) -> socket.socket:
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
