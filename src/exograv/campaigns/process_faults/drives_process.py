"""Handle of the process of the simulated drives."""

import contextlib
import subprocess
import sys
import threading

from exograv.errors import RigError
from exograv.live.on_drives.simulated_drives import GREETING

LOG_MAX_S = 20.0
"""Time in which the drives write their log [s]."""


class DrivesProcess:
    """Process of the simulated drives. It starts beside the session, which opens its bus seconds later."""

    def __init__(self, words: list[str]):
        """Start `drives.main` with these words."""
        self._process = subprocess.Popen(
            [sys.executable, "-m", f"{__package__}.drives", *words],
            stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, process_group=0,
        )  # fmt: skip
        self.said: list[str] = []
        self._reader = threading.Thread(target=self._read, daemon=True)
        self._reader.start()

    def refuse_dead(self) -> None:
        """Raise a RigError if the drives did not start."""
        if self._process.poll() is not None and GREETING not in "".join(self.said):
            raise RigError(f"The simulated drives of the process faults do not start: {''.join(self.said).strip()}")

    def end(self) -> None:
        """End the drives, which write their log."""
        assert self._process.stdin is not None
        with contextlib.suppress(OSError):
            self._process.stdin.write("quit\n")
            self._process.stdin.flush()
        try:
            self._process.wait(LOG_MAX_S)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()
        self._reader.join(2.0)
        for pipe in (self._process.stdin, self._process.stdout):
            assert pipe is not None
            pipe.close()

    def _read(self) -> None:
        assert self._process.stdout is not None
        for line in self._process.stdout:
            self.said.append(line)
