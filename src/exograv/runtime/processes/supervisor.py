"""Parent's side of a child process: start, receive its messages, replace it when it is dead or hangs, end it.

A supervisor holds one process at a time. Its owner decides when to replace the process, and by which job. The
supervisor counts replacements and refuses those beyond the limit.
"""

import contextlib
import time
from collections.abc import Callable, Iterator
from multiprocessing.connection import Connection
from typing import Any, Generic, TypeVar

from exograv.errors import RigError

from .process_line import SLICE_S, BrokenLineError, ProcessLine
from .spawn import spawned

READY_MAX_S = 120.0
"""Time for a process to build what it needs, including the compilation of its kernels [s]."""

EXIT_S = 1.0
"""Time for a process that was killed, or that closed its line, to leave its exit status [s]."""


Job = TypeVar("Job")


class Supervisor(Generic[Job]):
    """Process with its replacements."""

    def __init__(
        self,
        name: str,
        target: Callable[[Job, Connection], object],
        job: Job,
        fruitless_max: int = 0,
    ):
        """Start the first process.

        Args:
            name: Name of the process.
            target: Function that the process runs; it gets the job and its end of the line.
            job: Argument of the first process.
            fruitless_max: Limit of processes in a row that are replaced though they achieved nothing.
        """
        self._name, self._target, self._fruitless_max = name, target, fruitless_max
        self.restarts = self._fruitless = 0
        self._start(job)

    @property
    def pid(self) -> int:
        """Identifier of the present process; 0 if there is none."""
        return self._process.pid or 0

    @property
    def is_alive(self) -> bool:
        """True if the process runs, even if it hangs."""
        return self._process.is_alive()

    @property
    def exit_status(self) -> int | None:
        """Exit status; None while the process runs."""
        return self._process.exitcode

    def kill(self) -> None:
        """Kill the process at once."""
        self._process.kill()

    def send(self, word: object) -> None:
        """Send a message without waiting; a process that has died, or reads nothing, does not get it."""
        with contextlib.suppress(OSError):
            self._line.send(word)

    def flush(self) -> None:
        """Send messages that the process could not take before. `heard` and `await_exit` do this, too."""
        self._line.flush()

    def heard(self) -> Iterator[Any]:
        """Yield the messages that have arrived, and set `has_hung_up` when the process has closed its line.

        A process that sends anything but messages is killed.
        """
        try:
            yield from self._line.words()
        except BrokenLineError:
            self.kill()
            self._hung_up()
        except (EOFError, OSError):
            self._hung_up()

    def next_word(self, within_s: float) -> Any:
        """Return the next message; None after this time, or if the process has closed its line (`has_hung_up`)."""
        try:
            return self._line.next_word(within_s)
        except (EOFError, OSError):
            self.has_hung_up = True
            return None

    def await_ready(self) -> None:
        """Wait for the first message, which says that the process is ready.

        Raises:
            RigError: The process has died, or takes too long.
        """
        if self.next_word(READY_MAX_S) is None:
            self._process.join(EXIT_S)
            raise RigError(
                f"The process '{self._name}' was not ready (exit status {self.exit_status}). Its output above gives "
                "the reason. Correct it, then repeat."
            )

    def await_exit(self, within_s: float) -> int | None:
        """Wait for the end of the process; return its exit status, or None if it still runs."""
        until = time.monotonic() + within_s
        while self._line.has_unsent and self._process.is_alive() and time.monotonic() < until:
            self._process.join(SLICE_S)
            self._line.flush()
        self._process.join(max(until - time.monotonic(), 0.0))
        return self.exit_status

    def succeeded(self) -> None:
        """Restart the count of fruitless replacements: the present process has achieved something."""
        self._fruitless = 0

    def replace(self, job: Job, was_fruitless: bool = True) -> bool:
        """Kill the process if it still runs, and start another; return False if the limit of replacements is reached.

        Args:
            job: Argument of the next process.
            was_fruitless: True if the process that is replaced counts for the limit; else the count begins again.
        """
        if was_fruitless and self._fruitless >= self._fruitless_max:
            return False
        self._fruitless = self._fruitless + 1 if was_fruitless else 0
        self.restarts += 1
        self._kill()
        self._line.close()
        self._start(job)
        return True

    def hang_up(self, patience_s: float) -> None:
        """Close the line, which tells the process that the parent is gone, and wait for its end."""
        self._line.close()
        self._process.join(patience_s)

    def end(self, patience_s: float, word: object = None) -> None:
        """End the process: send `word`, or close the line without one; kill the process after `patience_s`."""
        if word is None:
            self.hang_up(patience_s)
        else:
            self.send(word)
            self.await_exit(patience_s)
        self._kill()
        self._line.close()

    def _start(self, job: Job) -> None:
        self._process, connection = spawned(self._name, self._target, job)
        self._line = ProcessLine(connection)
        self.has_hung_up = False

    def _hung_up(self) -> None:
        self.has_hung_up = True
        self._process.join(EXIT_S)

    def _kill(self) -> None:
        if self._process.is_alive():
            self._process.kill()
            self._process.join(EXIT_S)
