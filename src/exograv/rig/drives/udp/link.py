"""Session with one controller: sends datagrams and returns the newest valid one, without unbounded waits or buffers."""

import math
import secrets
import select
import socket
import time
from collections import Counter
from typing import Any, NamedTuple

from exograv.errors import RigError

from .layout import SEQUENCES, STATE_JOINT, DriveFlag, Flag, Type, is_newer
from .packets import Header, Packet, Refusal, RefusedError, decode, encode

HELLO_EVERY_S = 0.02
REMEMBERED = 64
"""Number of polls that are remembered for late answers."""

READ_AT_ONCE = 32
"""Largest number of packets that are read at once. A flood of packets must not delay our tick."""

BUFFER = 2048
STEP = len(STATE_JOINT)
PRESENT = int(DriveFlag.PRESENT)
POSITION, MOTOR_POSITION, CURRENT, TEMPERATURE, STATUS, FAULT, CODE, SAMPLES = range(STEP)


class UdpAnswer(NamedTuple):
    """State of the machine, and the poll that it answers."""

    tick: int
    t: float
    """Time at which that poll was sent, on our clock [s]."""
    packet: Packet


class Link:
    """Link to one controller; times are those of `clock` [s]."""

    def __init__(self, address: tuple[str, int], joints: int, first_sequence: int = 0):
        """Send nothing before `open`.

        Args:
            address: Address of the controller.
            joints: Number of joints that the controller must have.
            first_sequence: First sequence of our packets; tests start close to the wrap.
        """
        self.address, self._n = address, joints
        self.counts: Counter[str] = Counter()
        """Number of refused packets by reason, and of missing ones; the names are a fixed set."""
        self._sequence = first_sequence
        self._socket: socket.socket | None = None
        self._session = self._grant = 0
        self._heard = 0
        self._polls: list[tuple[int, int, float]] = [(-1, -1, 0.0)] * REMEMBERED
        self._states: list[tuple[int, int, float]] = [(-1, -1, 0.0)] * REMEMBERED

    def open(self) -> None:
        """Open the socket, which receives packets of this controller only.

        Raises:
            RigError: The address does not exist.
        """
        made = None
        try:
            made = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
            made.setblocking(False)
            made.connect(self.address)
        except OSError as error:
            if made is not None:
                made.close()
            raise RigError(
                f"udp.host {self.address[0]}, port {self.address[1]} cannot be used: {error.strerror or error}. "
                "Correct it in drives.toml."
            ) from error
        self._socket, self._session = made, secrets.randbelow(2**32 - 1) + 1

    def close(self) -> None:
        """Release the controller, and close the socket."""
        if self._socket is not None:
            try:
                self._send(self._header(Type.BYE))
            finally:
                self._socket.close()
                self._socket = None

    def hello(self, patience_s: float) -> Packet:
        """Start the session, or restart it with a controller that has forgotten it; return the nameplate.

        Raises:
            RigError: No controller answers, or another host has the controller.
        """
        self._grant = 0
        self._polls = [(-1, -1, 0.0)] * REMEMBERED
        self._states = [(-1, -1, 0.0)] * REMEMBERED
        ends, is_taken = time.monotonic() + patience_s, False
        while time.monotonic() < ends:
            asked = self._send(self._header(Type.HELLO, joints=0))
            if (packet := self._nameplate(asked, time.monotonic() + HELLO_EVERY_S)) is None:
                continue
            is_taken = bool(packet.header.flags & Flag.TAKEN)
            if not is_taken:
                self._grant, self._heard = packet.header.grant, packet.header.sequence
                return packet
            time.sleep(HELLO_EVERY_S)
        host, port = self.address
        if is_taken:
            raise RigError(
                f"The controller at {host}:{port} is commanded by another host. End that program first. The controller "
                "is free after that host's BYE, or a watchdog's time after its last packet."
            )
        raise RigError(
            f"No controller answers at {host}:{port} within {patience_s:g} s. Is it on, is the cable plugged in, and "
            "are udp.host and udp.port in drives.toml right? Without hardware: exograv dev drive-sim --bus udp."
        )

    def poll(self, tick: int, t: float) -> None:
        """Ask for a state."""
        sequence = self._send(self._header(Type.POLL))
        self._polls[sequence % REMEMBERED] = sequence, tick, t

    def collect(self, tick: int, until: float) -> UdpAnswer | None:
        """Return the newest state before `until` on `time.monotonic`; at once if it answers this tick's poll."""
        newest = None
        for _ in range(READ_AT_ONCE):
            if (packet := self._receive(Type.STATE, until)) is None:
                break
            if (answer := self._answer(packet)) is not None:
                newest = answer
                if answer.tick == tick:
                    return newest
        self.counts["late or lost states"] += 1
        return newest

    def command(self, tick: int, now: float, life_s: float, flags: Flag, joints: tuple[float, ...]) -> int | None:
        """Send a command that answers a tick's state; return its sequence, or None if there is no such state.

        Args:
            tick: Tick of the poll that led to the command.
            now: Present time on the clock of `poll` [s].
            life_s: Life of the command from its receipt [s].
            flags: ENABLE and ACKNOWLEDGE.
            joints: Current [A] and damping [N·m·s/rad] of each joint.
        """
        known, state, t = self._states[tick % REMEMBERED]
        if known != tick and flags:
            return None
        age_us = min(max(round(1e6 * (now - t)), 0), SEQUENCES - 1)
        life_us = min(max(int(1e6 * life_s), 0), SEQUENCES - 1)
        return self._send(self._header(Type.COMMAND, flags, max(state, 0)), (age_us, life_us), joints)

    def _header(self, kind: Type, flags: Flag = Flag.NONE, answers: int = 0, joints: int | None = None) -> Header:
        self._sequence = (self._sequence + 1) % SEQUENCES
        n = self._n if joints is None else joints
        return Header(kind, n, int(flags), self._session, self._grant, self._sequence, answers, time.monotonic_ns())

    def _send(self, header: Header, own: tuple[Any, ...] = (), joints: tuple[Any, ...] = ()) -> int:
        if self._socket is None:
            raise RigError("The link to the controller is not open. Use the machine inside `with rig:`.")
        try:
            self._socket.send(encode(header, own, joints))
        except OSError:  # no receiver, or a full buffer: the same as a lost packet
            self.counts["not sent"] += 1
        return header.sequence

    def _receive(self, kind: Type, until: float) -> Packet | None:
        """Return the next valid packet of this type before `until`."""
        opened = self._socket
        if opened is None:
            return None
        for _ in range(READ_AT_ONCE):
            try:
                data = opened.recv(BUFFER)
            except BlockingIOError:
                left = until - time.monotonic()
                if left <= 0.0 or not select.select((opened,), (), (), left)[0]:
                    return None
                continue
            except OSError:  # an earlier packet found no receiver
                self.counts["not heard"] += 1
                if time.monotonic() >= until:
                    return None
                continue
            try:
                return self._believed(decode(data), kind)
            except RefusedError as refused:
                self.counts[refused.why.value] += 1
        return None

    def _believed(self, packet: Packet, kind: Type) -> Packet:
        header = packet.header
        if header.kind is not kind:
            raise RefusedError(Refusal.TYPE)
        if header.session != self._session:
            raise RefusedError(Refusal.SESSION)
        if kind is Type.STATE and (header.grant != self._grant or header.joints != self._n):
            raise RefusedError(Refusal.SESSION)
        return packet

    def _nameplate(self, asked: int, until: float) -> Packet | None:
        while (packet := self._receive(Type.NAMEPLATE, until)) is not None:
            if packet.header.answers == asked:
                return packet
            self.counts[Refusal.SEQUENCE.value] += 1
        return None

    def _answer(self, packet: Packet) -> UdpAnswer | None:
        header = packet.header
        sequence, tick, t = self._polls[header.answers % REMEMBERED]
        if not is_newer(header.sequence, self._heard) or sequence != header.answers:
            self.counts[Refusal.SEQUENCE.value] += 1
            return None
        if not _has_numbers(packet.joints):
            self.counts[Refusal.NUMBER.value] += 1
            return None
        self._heard = header.sequence
        self._states[tick % REMEMBERED] = tick, header.sequence, t
        return UdpAnswer(tick, t, packet)


def _has_numbers(joints: tuple[Any, ...]) -> bool:
    """Return True if all drives that have contact with the controller report a position and a current."""
    return all(
        math.isfinite(joints[k + POSITION]) and math.isfinite(joints[k + CURRENT])
        for k in range(0, len(joints), STEP)
        if joints[k + STATUS] & PRESENT
    )
