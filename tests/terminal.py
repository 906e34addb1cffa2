"""Command in a terminal of its own, where Ctrl-C is a key: the terminal sends SIGINT to all processes in front."""

import contextlib
import os
import pty
import re
import subprocess
import sys
import threading
from collections.abc import Iterator, Sequence
from pathlib import Path

from tests.waiting import wait_until

CTRL_C = b"\x03"

BEGIN = """\
import fcntl, signal, sys, termios
fcntl.ioctl(0, termios.TIOCSCTTY, 0)
signal.signal(signal.SIGINT, signal.default_int_handler)  # a shell in the background lets its children ignore it
from exograv.cli import main
main()
"""

STYLE = re.compile(r"\x1b\[[0-9;?]*[a-zA-Z]")


class TerminalRun:
    """Running command, with all that it printed so far."""

    def __init__(self, process: subprocess.Popen[bytes], ours: int):
        self.process, self._ours, self._printed = process, ours, bytearray()
        self._reader = threading.Thread(target=self._read, daemon=True)
        self._reader.start()

    def _read(self) -> None:
        with contextlib.suppress(OSError):  # the other end closes with the last process
            while block := os.read(self._ours, 4096):
                self._printed += block

    @property
    def text(self) -> str:
        """Printed text without colours, with single spaces."""
        return " ".join(STYLE.sub("", self._printed.decode(errors="replace")).split())

    def press(self, key: bytes) -> None:
        """Press a key of the terminal."""
        os.write(self._ours, key)

    def end(self, seconds: float) -> int:
        """Wait for the end of the command, and return its exit status."""
        status = self.process.wait(seconds)
        self._reader.join(seconds)
        return status


@contextlib.contextmanager
def in_terminal(words: Sequence[str], folder: Path) -> Iterator[TerminalRun]:
    """Start `exograv` with these words in a terminal; kill it at the end of the block if it still runs."""
    ours, theirs = pty.openpty()
    command = [sys.executable, "-c", BEGIN, *words]
    with subprocess.Popen(
        command, cwd=folder, stdin=theirs, stdout=theirs, stderr=theirs, start_new_session=True
    ) as process:
        os.close(theirs)
        try:
            yield TerminalRun(process, ours)
        finally:
            process.kill()
            process.wait()
            os.close(ours)


def ctrl_c_after(run: TerminalRun, said: str, seconds: float) -> int:
    """Press Ctrl-C when the command has printed this text; return the exit status."""
    wait_until(lambda: said in run.text or run.process.poll() is not None, lambda: run.text[-2000:], seconds)
    run.press(CTRL_C)
    return run.end(seconds)
