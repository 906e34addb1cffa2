"""Simulated fdcanusb: a serial port of this computer with the adapter's line protocol, without a wire behind it.

Source: mjbots fdcanusb, README; written independently of the driver's side (`rig.drives.moteus.fdcanusb`).
"""

import contextlib
import os
import select
import sys
from collections.abc import Iterator
from pathlib import Path

from exograv.errors import RigError

AT_ONCE = 8192
POLYNOMIAL = 0x97
"""Polynomial of the check sum ` *XX` that may end a line. A line with check sum gets an answer with one."""


class SimulatedFdcanusb:
    """Adapter at a path that exists as long as the adapter."""

    def __init__(self, path: str):
        """Open a pseudo-terminal, and link it to this path.

        Raises:
            RigError: The path is in use.
        """
        if sys.platform == "win32":
            raise RigError("A simulated moteus adapter needs a pseudo-terminal, which Windows does not have. Use udp.")
        import tty

        self.path = Path(path)
        self._ours, self._theirs = os.openpty()
        tty.setraw(self._theirs)
        os.set_blocking(self._ours, False)
        self._rest, self._checks = b"", False
        self.is_cut = False
        """True if the cable to the host is disconnected:

        no answer is sent, and lines only drive the clock of a lock-step.
        """
        try:
            if self.path.is_symlink() and str(self.path.readlink()).startswith("/dev/pts/"):
                self.path.unlink()  # left by a simulation that was killed
            self.path.symlink_to(os.ttyname(self._theirs))
        except OSError as error:
            self._close()
            raise RigError(
                f"moteus.path {path} is not free for a simulated adapter: {error.strerror}. Give a path in a folder "
                "that exists, at which there is nothing yet."
            ) from error

    def close(self) -> None:
        """Remove the path and close the port."""
        with contextlib.suppress(OSError):
            self.path.unlink()
        self._close()

    def frames(self, seconds: float) -> Iterator[tuple[int, bytes]]:
        """Yield the frames that are sent within `seconds` or have been sent: number and data."""
        if not select.select((self._ours,), (), (), max(seconds, 0.0))[0]:
            return
        try:
            *lines, self._rest = (self._rest + os.read(self._ours, AT_ONCE)).split(b"\n")
        except OSError:
            return
        for line in lines:
            if (frame := self._sent(line.strip())) is not None:
                yield frame

    def say(self, number: int, data: bytes) -> None:
        """Send a frame from the bus to the host."""
        self._write(b"rcv %04X %s E B F" % (number, data.hex().upper().encode()))

    def _sent(self, line: bytes) -> tuple[int, bytes] | None:
        if not line:
            return None
        said, star, check = line.rpartition(b"*")
        self._checks = bool(star)
        if star and check.upper() != b"%02X" % checksum(said):
            return self._complain(b"checksum mismatch")
        words = (said if star else line).split()
        if words[:2] != [b"can", b"send"] or len(words) < 4:
            return self._complain(b"unknown command")
        try:
            frame = int(words[2], 16), bytes.fromhex(words[3].decode("latin-1"))
        except ValueError:
            return self._complain(b"malformed frame")
        self._write(b"OK")
        return frame

    def _complain(self, why: bytes) -> None:
        self._write(b"ERR " + why)

    def _write(self, line: bytes) -> None:
        if self.is_cut:
            return
        if self._checks:
            line += b" "
            line += b"*%02X" % checksum(line)
        with contextlib.suppress(BlockingIOError):  # no host reads
            os.write(self._ours, line + b"\r\n")

    def _close(self) -> None:
        os.close(self._ours)
        os.close(self._theirs)


def checksum(data: bytes) -> int:
    """Check sum of a line up to its star."""
    crc = 0
    for byte in data:
        crc ^= byte
        for _ in range(8):
            crc = (crc << 1) ^ (POLYNOMIAL if crc & 0x80 else 0)
            crc &= 0xFF
    return crc
