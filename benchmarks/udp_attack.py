"""Packets of two ordinary hosts, and wrong packets made from them."""

import math
import random
import struct
import zlib
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, field

FRIEND, RIVAL, STRANGER = 1, 2, 3
"""Addresses of the hosts."""

LONGEST = 1500
WORDS = (8, 12, 16, 20, 32, 36)
"""Offsets of session, grant, sequence, answers, age and life."""

ODD = (0, 1, 2, 31, 32, 33, 2**15, 2**31 - 1, 2**31, 2**31 + 1, 2**32 - 2, 2**32 - 1)


def sealed(data: bytes) -> bytes:
    """Return the data with a right check sum."""
    return data + zlib.crc32(data).to_bytes(4, "little")


@dataclass
class Host:
    """Host that keeps to the protocol: hello, then polls and commands; motors on for a while, and off."""

    address: int
    dice: random.Random
    session: int = 0
    grant: int = 0
    sequence: int = 0
    state: int = 0
    commands: int = 0
    is_polling: bool = False
    polled_us: int = 0
    acknowledges: bool = True

    def next(self, now: int) -> bytes:
        """Return the host's next packet."""
        if self.grant == 0:
            self.session, self.sequence = self.dice.randrange(1, 2**32), self.dice.choice((0, 2**32 - 5, 77))
            self.commands = 0
            return self._packet(1, 0, b"\0" * 776, joints=0)
        if self.dice.random() < 0.0005:
            data = self._packet(6)
            self.grant = 0
            return data
        self.is_polling = not self.is_polling
        if self.is_polling:
            self.polled_us = now
            return self._packet(3, 0, b"\0" * 136)
        self.commands += 1
        return self._command(now)

    def hear(self, answer: bytes) -> None:
        """Take the controller's answer."""
        kind = answer[5] if answer else 0
        if kind == 2:
            self.grant = int.from_bytes(answer[12:16], "little")
            self.is_polling = False
        elif kind == 4:
            self.state = int.from_bytes(answer[16:20], "little")
        elif self.is_polling:  # the controller has forgotten this host: begin anew
            self.grant = 0

    def _command(self, now: int) -> bytes:
        # Enabled for two thirds of the time; before that the host acknowledges in most cases.
        turn = self.commands % 60
        if turn == 1:
            self.acknowledges = self.dice.random() < 0.7
        flags = 1 if turn >= 20 else 2 if self.acknowledges and turn < 4 else 0
        numbers = [x for _ in range(4) for x in (self.dice.uniform(-12.0, 12.0), self.dice.uniform(0.0, 5.0))]
        body = struct.pack("<II8f", max(now - self.polled_us, 0), self.dice.choice((5000, 20_000)), *numbers)
        return self._packet(5, flags, body, answers=self.state)

    def _packet(self, kind: int, flags: int = 0, body: bytes = b"", joints: int = 4, answers: int = 0) -> bytes:
        self.sequence = (self.sequence + 1) % 2**32
        who = self.session, self.grant, self.sequence, answers, self.sequence * 1000
        return sealed(b"EXGV" + struct.pack("<BBBBIIIIQ", 1, kind, joints, flags, *who) + body)


@dataclass
class Attack:
    """Generator of packets from a seed; it keeps some thousand sent packets, to send them again."""

    seed: int
    sent: deque[tuple[bytes, int]] = field(default_factory=lambda: deque(maxlen=4096))

    def __post_init__(self):
        self.dice = random.Random(self.seed)
        self.friend, self.rival = Host(FRIEND, self.dice), Host(RIVAL, self.dice)
        self._kinds: list[Callable[[bytes], bytes]] = [
            self._noise,
            self._flipped,
            self._cut,
            self._grown,
            self._patched,
            self._patched,
            self._patched_twice,
            self._number,
        ]

    def next(self, now: int) -> tuple[bytes, int, Host | None]:
        """Return a packet, its address, and the host that waits for an answer."""
        chance = self.dice.random()
        if chance < 0.25 or not self.sent:
            return self._kept(self.friend, now)
        if chance < 0.27:
            return self._kept(self.rival, now)
        data, address = self.dice.choice(self.sent)
        if chance < 0.4:
            return data, address, None  # replayed, from this session or an earlier one
        if self.dice.random() < 0.7:
            data, address = self.sent[-1]
        if chance < 0.45:
            return data, STRANGER, None
        address = self.dice.choice((address, address, address, STRANGER))
        return self.dice.choice(self._kinds)(data), address, None

    def _kept(self, host: Host, now: int) -> tuple[bytes, int, Host]:
        data = host.next(now)
        self.sent.append((data, host.address))
        return data, host.address, host

    def _noise(self, data: bytes) -> bytes:
        size = self.dice.choice((0, 1, len(data), self.dice.randrange(LONGEST)))
        return self.dice.randbytes(size)

    def _flipped(self, data: bytes) -> bytes:
        changed = bytearray(data)
        for _ in range(self.dice.choice((1, 1, 2, 8))):
            bit = self.dice.randrange(8 * len(changed))
            changed[bit // 8] ^= 1 << bit % 8
        return bytes(changed)

    def _cut(self, data: bytes) -> bytes:
        short = data[: self.dice.randrange(len(data))]
        return short if self.dice.random() < 0.5 or len(short) < 4 else sealed(short[:-4])

    def _grown(self, data: bytes) -> bytes:
        more = self.dice.randbytes(self.dice.randrange(1, 64))
        return data + more if self.dice.random() < 0.5 else sealed(data[:-4] + more)

    def _patched(self, data: bytes) -> bytes:
        """Change one field, with a right check sum."""
        changed = bytearray(data[:-4])
        at = self.dice.choice((*WORDS, 0, 4, 5, 6, 7, 7))
        if at < 8:
            changed[at] = self.dice.choice((0, 1, 2, 3, 4, 5, 6, 7, 16, 17, 255))
        elif at + 4 <= len(changed):
            value = int.from_bytes(changed[at : at + 4], "little") + self.dice.choice((-1, 1, 1, 2, -100, 2**31))
            value = self.dice.choice((value, value, *ODD[:3], self.dice.choice(ODD)))
            changed[at : at + 4] = (value % 2**32).to_bytes(4, "little")
        return sealed(bytes(changed))

    def _patched_twice(self, data: bytes) -> bytes:
        return self._patched(self._patched(data))

    def _number(self, data: bytes) -> bytes:
        """Put a non-finite number or a negative damping in a newer packet."""
        if data[5] != 5:
            return self._patched(data)
        changed = bytearray(data[:-4])
        newer = int.from_bytes(changed[16:20], "little") + 1
        changed[16:20] = (newer % 2**32).to_bytes(4, "little")
        value = self.dice.choice((math.nan, math.inf, -math.inf, -1.0, 3e38))
        struct.pack_into("<f", changed, 40 + 4 * self.dice.randrange(8), value)
        return sealed(bytes(changed))
