"""A CAN-FD adapter that speaks fdcanusb's lines: frames out, frames in, and no wait that is longer than it may be.

Source: mjbots fdcanusb, README; mjbots moteus, docs/protocol/can.md.
"""

import os
import select
import sys
import time
from collections import Counter, deque
from typing import NamedTuple

from exograv.errors import RigError

SIZES = (0, 1, 2, 3, 4, 5, 6, 7, 8, 12, 16, 20, 24, 32, 48, 64)
"""Bytes that a CAN-FD frame can have."""

FILLED_UP = b"\x50"
"""A subframe that says nothing."""

ANSWER_WANTED, NUMBER = 0x80, 0x7F
SPOILS = b"!\n"
"""Ends a line that was sent in part, so that it is no frame: a shorter one would be obeyed, with the drive's defaults
for what is missing."""

AT_ONCE = 4096


class CanFdFrame(NamedTuple):
    """Heard on the bus."""

    arbitration_id: int
    data: bytes

    @property
    def source(self) -> int:
        """Who said it."""
        return self.arbitration_id >> 8 & NUMBER

    @property
    def destination(self) -> int:
        """To whom."""
        return self.arbitration_id & NUMBER


def head(destination: int, source: int, wants_answer: bool) -> bytes:
    """How a line begins that sends a frame."""
    return b"can send %04x " % ((source | (ANSWER_WANTED if wants_answer else 0)) << 8 | destination)


def line(head: bytes, data: bytes | bytearray) -> bytes:
    """Which sends these bytes, filled up to a size that CAN-FD has."""
    size = next(size for size in SIZES if size >= len(data))
    return b"%s%s BF\n" % (head, bytes(data).ljust(size, FILLED_UP).hex().upper().encode())


class Fdcanusb:
    """One adapter, ours alone; what fails in the loop is counted and is silence, it raises nothing there."""

    def __init__(self, path: str):
        """Open it, and forget what it said before.

        Raises:
            RigError: It is not there, or somebody else has it.
        """
        self.counts: Counter[str] = Counter()
        self.error = ""
        """What the adapter complained of last."""
        self._rest, self._is_torn = b"", False
        self._lines: deque[bytes] = deque()
        self._fd = _opened(path)

    def close(self) -> None:
        """Give it back."""
        os.close(self._fd)

    def send(self, lines: bytes) -> None:
        """Whole lines; a full or dead adapter loses them, and the silence that follows is what is noticed."""
        data = SPOILS + lines if self._is_torn else lines
        try:
            sent = os.write(self._fd, data)
        except OSError:
            self.counts["not sent"] += 1
            return
        self._is_torn = sent < len(data) and not data[:sent].endswith(b"\n")
        if sent < len(data):
            self.counts["not sent"] += 1

    def receive(self, until: float) -> CanFdFrame | None:
        """The next frame that comes until then, on `time.monotonic`; what has come already, whenever that is."""
        while True:
            while self._lines:
                if (frame := self._frame(self._lines.popleft())) is not None:
                    return frame
            if not self._read(until):
                return None

    def _read(self, until: float) -> bool:
        """Whether anything came."""
        left = until - time.monotonic()
        try:
            if not select.select((self._fd,), (), (), max(left, 0.0))[0]:
                return False
            data = os.read(self._fd, AT_ONCE)
        except OSError:
            data = b""
        if not data:  # a plug that was pulled is always ready, and says nothing
            self.counts["not heard"] += 1
            return False
        *lines, self._rest = (self._rest + data).split(b"\n")
        self._lines.extend(lines)
        return True

    def _frame(self, text: bytes) -> CanFdFrame | None:
        words = text.split()
        if not words or words[0] == b"OK":
            return None
        if words[0] == b"ERR":
            self.counts["adapter errors"] += 1
            self.error = text.decode("latin-1").strip()
            return None
        try:
            return CanFdFrame(int(words[1], 16), bytes.fromhex(words[2].decode()))
        except (IndexError, ValueError):
            self.counts["garbled"] += 1
            return None


def _opened(path: str) -> int:
    if sys.platform == "win32":
        raise RigError(f"moteus.path {path}: a moteus adapter is reached from Linux or macOS, and this is Windows.")
    from .serial_port import open_port

    return open_port(path)
