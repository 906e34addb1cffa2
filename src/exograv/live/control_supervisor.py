"""Supervisor of the control process in its parent: it starts control, watches it, and replaces it when it fails."""

from collections.abc import Callable

from exograv.runtime.control_loop.answering import ControlInterface, ControlJob, control_process
from exograv.runtime.control_loop.exchange import Channels
from exograv.runtime.processes.shared_memory import Mailbox
from exograv.runtime.processes.supervisor import Supervisor

HANGS_TICKS = 2000
"""Unanswered requests of the guard after which a control process that is alive is ended and replaced.

By then the guard has been lowering the arm for a long time. The limit is a count of requests, not a time, because the
guard sends no request without a measurement of the machine.
"""

FRUITLESS_MAX = 3
"""Control processes in a row that may end without an answer; the same cause would end the next one too."""


Build = Callable[[], ControlInterface]


class ControlKeeper:
    """Control process, replaced when it has died or hangs. No control process can release the latch of the guard."""

    def __init__(self, first: Build, again: Build, channels: Channels, states: Mailbox, answers: Mailbox):
        """Start the first control process. `again` is the function that builds a replacement."""
        self._again, self._channels, self._states, self._answers = again, channels, states, answers
        self._seen = self._asked = 0
        self._child = Supervisor("control", control_process, ControlJob(first, channels), FRUITLESS_MAX)
        self._at_start = answers.count

    @property
    def pid(self) -> int:
        """Process identifier of the present control."""
        return self._child.pid

    @property
    def restarts(self) -> int:
        """Number of control processes that were replaced."""
        return self._child.restarts

    def await_ready(self) -> None:
        """Wait until the control process is ready.

        Raises:
            RigError: The control process has died.
        """
        self._child.await_ready()

    def check(self) -> None:
        """Replace the control process if it has died or does not answer any more. Call this several times a second."""
        answered, asked = self._answers.count, self._states.count
        if answered != self._seen:
            self._seen, self._asked = answered, asked
            self._child.succeeded()
        hangs = answered != self._at_start and asked - self._asked > HANGS_TICKS
        if (not self._child.is_alive or hangs) and self._child.replace(ControlJob(self._again, self._channels)):
            self._asked, self._at_start = asked, self._answers.count

    def close(self) -> None:
        """End the control process."""
        self._child.end(2.0, "over")
