"""CAN-FD adapter with the fdcanusb line protocol: frames out, frames in, with a time-out on every wait.

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
"""Possible sizes of a CAN-FD frame [byte]."""

FILLED_UP = b"\x50"
"""Subframe without content, to fill a frame up."""

ANSWER_WANTED, NUMBER = 0x80, 0x7F
SPOILS = b"!\n"
"""Text that ends a partly sent line and makes it invalid.

The drive would obey a shorter frame, with its defaults for the missing values.
"""

AT_ONCE = 4096


class CanFdFrame(NamedTuple):
    """Frame that was received from the bus."""

    arbitration_id: int
    data: bytes

    @property
    def source(self) -> int:
        """Node number of the sender."""
        return self.arbitration_id >> 8 & NUMBER

    @property
    def destination(self) -> int:
        """Node number of the receiver."""
        return self.arbitration_id & NUMBER


def head(destination: int, source: int, wants_answer: bool) -> bytes:
    """Start of a line that sends a frame."""
    return b"can send %04x " % ((source | (ANSWER_WANTED if wants_answer else 0)) << 8 | destination)


def line(head: bytes, data: bytes | bytearray) -> bytes:
    """Line that sends these bytes, filled up to a size that CAN-FD has."""
    size = next(size for size in SIZES if size >= len(data))
    return b"%s%s BF\n" % (head, bytes(data).ljust(size, FILLED_UP).hex().upper().encode())


class Fdcanusb:
    """Adapter, used by this program only. Failures in the loop are counted and look like silence; none raises there."""

    def __init__(self, path: str):
        """Open the adapter, and discard its older output.

        Raises:
            RigError: The adapter does not exist, or another program has it.
        """
        self.counts: Counter[str] = Counter()
        self.error = ""
        """Last error message of the adapter."""
        self._rest, self._is_torn = b"", False
        self._lines: deque[bytes] = deque()
        self._fd = _opened(path)

    def close(self) -> None:
        """Close the adapter's serial device."""
        os.close(self._fd)

    def send(self, lines: bytes) -> None:
        """Send whole lines. A full or disconnected adapter loses them; missing answers then show the loss."""
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
        """Return the next frame, waiting or arriving before `until` on `time.monotonic`."""
        while True:
            while self._lines:
                if (frame := self._frame(self._lines.popleft())) is not None:
                    return frame
            if not self._read(until):
                return None

    def _read(self, until: float) -> bool:
        """Return True if any bytes arrived."""
        left = until - time.monotonic()
        try:
            if not select.select((self._fd,), (), (), max(left, 0.0))[0]:
                return False
            data = os.read(self._fd, AT_ONCE)
        except OSError:
            data = b""
        if not data:  # a disconnected adapter is always ready and returns no bytes
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
        raise RigError(f"moteus.path {path}: a moteus adapter works on Linux and macOS, not on Windows.")
    from .serial_port import open_port

    return open_port(path)
