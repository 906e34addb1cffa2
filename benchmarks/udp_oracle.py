"""Oracle: the actions that docs/reference/udp_protocol.md allows a controller of four joints.

The oracle is written from the page and from no program. Offsets are written out, times are whole microseconds. Where a
clock of another kind may round, both results are allowed.
"""

import math
import struct
import zlib
from dataclasses import dataclass, field

LENGTHS = {1: (0, 812), 3: (4, 172), 5: (4, 76), 6: (4, 36)}
"""Packets that a host may send, by type: joints in the header, bytes."""

LIMITS = (9.0, 9.0, 6.7, 6.7)
WATCHDOG_US, STATES = 20_000, 32


class ForbiddenError(AssertionError):
    """Action of the controller that no valid packet asked for."""


def word(data: bytes, at: int) -> int:
    """Return the little-endian number in the four bytes from `at`."""
    return int.from_bytes(data[at : at + 4], "little")


def is_after(a: int, b: int) -> bool:
    """Return True if sequence number `a` comes after `b`, also across the wrap."""
    return a != b and (a - b) & 0xFFFFFFFF < 0x80000000


def is_whole(data: bytes) -> bool:
    """Return True if length, magic, version, type, number of joints and check sum are right."""
    if len(data) < 36 or data[:5] != b"EXGV\x01" or data[5] not in LENGTHS:
        return False
    return (data[6], len(data)) == LENGTHS[data[5]] and word(data, len(data) - 4) == zlib.crc32(data[:-4])


@dataclass
class Oracle:
    """Model that follows every packet and every answer; `step` checks the motor currents against the commands."""

    exact: bool = True
    """True if the drives give exactly the commanded current, and not less when they are warm."""
    host: tuple[int, int, int] | None = None
    """Session, grant and address of the host."""
    newest: int = 0
    heard_us: int = 0
    states: dict[int, int] = field(default_factory=dict)
    was_enabled: bool = False
    is_on: bool = False
    has_tripped: bool = False
    asked: tuple[float, ...] = ()
    told_us: int = 0
    until_us: int = 0
    steps_with_torque: int = 0
    accepted: int = 0

    def packet(self, data: bytes, address: int, now: int, answer: bytes) -> None:
        """Take a packet and its answer."""
        if len(answer) > len(data):
            raise ForbiddenError(f"{len(answer)} bytes answer {len(data)}")
        if answer and not self._is_own(answer):
            raise ForbiddenError("an answer that is no valid packet")
        kind = data[5] if is_whole(data) else 0
        if kind == 1:
            self._hello(data, address, now, answer)
            return
        is_hosts = (
            kind != 0
            and self.host == (word(data, 8), word(data, 12), address)
            and is_after(word(data, 16), self.newest)
        )
        if is_hosts and kind == 3:
            self._poll(data, now, answer)
        elif answer:
            raise ForbiddenError(f"an answer to a packet that asks for none, type {kind}")
        elif is_hosts and kind == 5:
            self._command(data, now)
        elif is_hosts:
            self._all_off()
            self.host = None

    def step(self, now: int, currents: tuple[float, ...]) -> None:
        """Check the motor currents of the next period [A]."""
        if self.is_on and now - self.told_us > WATCHDOG_US:
            self.is_on, self.has_tripped = False, True
        may = self.is_on and bool(self.asked) and now <= self.until_us + 1
        for joint, current in enumerate(currents):
            if current == 0.0:
                continue
            if not may:
                raise ForbiddenError(f"joint {joint} has {current} A at {now} µs, which no valid command asks for")
            wanted = min(max(self.asked[joint], -LIMITS[joint]), LIMITS[joint])
            is_less = not self.exact and 0.0 < current / wanted < 1.0
            if not (math.isclose(current, wanted, rel_tol=1e-6) or is_less):
                raise ForbiddenError(f"joint {joint} has {current} A at {now} µs where {wanted} A are asked")
        self.steps_with_torque += any(currents)

    def _is_own(self, answer: bytes) -> bool:
        is_sound = word(answer, len(answer) - 4) == zlib.crc32(answer[:-4])
        return answer[:5] == b"EXGV\x01" and is_sound and {2: 812, 4: 172}.get(answer[5]) == len(answer)

    def _hello(self, data: bytes, address: int, now: int, answer: bytes) -> None:
        session, grant, sequence = word(data, 8), word(data, 12), word(data, 16)
        if session == 0 or grant != 0:
            self._silent(answer)
            return
        if self.host is not None and (session, address) == (self.host[0], self.host[2]):
            if not is_after(sequence, self.newest):
                self._silent(answer)
                return
        elif self.host is not None:
            is_taken, silence = bool(answer) and bool(answer[7] & 4), now - self.heard_us
            if abs(silence - WATCHDOG_US) > 2 and is_taken != (silence < WATCHDOG_US):
                raise ForbiddenError(f"taken: {is_taken}, after {silence} µs of silence")
            if is_taken:
                if word(answer, 12):
                    raise ForbiddenError("a second host was granted the machine")
                return
        if not answer or not word(answer, 12):
            raise ForbiddenError("a valid hello is not granted")
        self.host = session, word(answer, 12), address
        self.newest, self.heard_us = sequence, now
        self.accepted += 1
        self._all_off()

    def _silent(self, answer: bytes) -> None:
        if answer:
            raise ForbiddenError("an answer to an invalid hello")

    def _poll(self, data: bytes, now: int, answer: bytes) -> None:
        if not answer or answer[5] != 4 or answer[8:16] != data[8:16] or answer[20:24] != data[16:20]:
            raise ForbiddenError("a valid poll is not answered")
        self._accept(data, now)
        self.states[word(answer, 16)] = now
        while len(self.states) > STATES:
            del self.states[next(iter(self.states))]

    def _command(self, data: bytes, now: int) -> None:
        numbers = struct.unpack("<8f", data[40:72])
        if not all(map(math.isfinite, numbers)) or min(numbers[1::2]) < 0.0:
            return
        enables, acknowledges = bool(data[7] & 1), bool(data[7] & 2)
        polled = self.states.get(word(data, 20))
        until = 0 if polled is None else min(polled + word(data, 32), now) + word(data, 36)
        if (enables or acknowledges) and (polled is None or until <= now - 1):
            return
        self._accept(data, now)
        if not enables:
            self.is_on, self.asked = False, ()
            self.has_tripped = self.has_tripped and not acknowledges
        elif not self.was_enabled:
            if not self.has_tripped:
                self.is_on, self.asked, self.told_us = True, (), now
        elif self.is_on:
            self.asked, self.told_us, self.until_us = numbers[0::2], now, until
        self.was_enabled = enables

    def _accept(self, data: bytes, now: int) -> None:
        self.newest, self.heard_us = word(data, 16), now
        self.accepted += 1

    def _all_off(self) -> None:
        self.was_enabled, self.is_on, self.asked, self.states = False, False, (), {}
