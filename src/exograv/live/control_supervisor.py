"""The parent's side of control: started, watched, replaced when it has died or hangs."""

import contextlib
from collections.abc import Callable
from multiprocessing.connection import Connection
from multiprocessing.process import BaseProcess
from typing import Any

from exograv.errors import RigError
from exograv.runtime.control_loop.answering import Answering, ControlJob, control_process
from exograv.runtime.control_loop.exchange import Channels
from exograv.runtime.processes.shared_memory import Mailbox
from exograv.runtime.processes.spawn import spawned

READY_MAX_S = 120.0
"""For a process to build what it needs, kernels compiled in it."""

HANGS_TICKS = 2000
"""In which the guard asked and nobody answered, after which a control that is alive is ended and replaced; the arm has
long been coming down. Not a time: a guard whose machine says nothing does not ask."""

FRUITLESS_MAX = 3
"""Controls in a row that ended without one answer; what ends them would end the next one too."""


Build = Callable[[], Answering]


class ControlKeeper:
    """Control's process, and the next one when it has died or hangs; none of them can leave the guard's latch."""

    def __init__(self, first: Build, again: Build, channels: Channels, states: Mailbox, answers: Mailbox):
        """Start the first; all that follow are built by `again`."""
        self._again, self._channels, self._states, self._answers = again, channels, states, answers
        self.restarts = 0
        self._fruitless = self._seen = self._asked = 0
        self._start(first)

    @property
    def pid(self) -> int:
        """Of the control in charge."""
        return self._process.pid or 0

    def await_ready(self) -> None:
        """Wait until it has built what it needs.

        Raises:
            RigError: It has died.
        """
        await_word(self._process, self._connection)

    def check(self) -> None:
        """Replace it if it has died, or does not answer any more. To be called some times a second."""
        answered, asked = self._answers.count, self._states.count
        if answered != self._seen:
            self._seen, self._asked, self._fruitless = answered, asked, 0
        hangs = answered != self._at_start and asked - self._asked > HANGS_TICKS
        if (self._process.is_alive() and not hangs) or self._fruitless >= FRUITLESS_MAX:
            return
        self._end(0.0)
        self.restarts += 1
        self._fruitless += 1
        self._asked = asked
        self._start(self._again)

    def close(self) -> None:
        """Say that it is over."""
        self._end(2.0)

    def _start(self, build: Build) -> None:
        job = ControlJob(build, self._channels)
        self._process, self._connection = spawned("control", control_process, job)
        self._at_start = self._answers.count

    def _end(self, patience_s: float) -> None:
        with contextlib.suppress(OSError):
            self._connection.send("over")
        self._process.join(patience_s)
        if self._process.is_alive():
            self._process.kill()
            self._process.join(1.0)
        self._connection.close()


def await_word(process: BaseProcess, connection: Connection) -> Any:
    """What a process says when it is ready.

    Raises:
        RigError: It has died, or takes too long.
    """
    try:
        if connection.poll(READY_MAX_S):
            return connection.recv()
    except EOFError:
        pass
    process.join(1.0)
    raise RigError(
        f"The process '{process.name}' was not ready (exit status {process.exitcode}). What it wrote above says why; "
        "then repeat."
    )
