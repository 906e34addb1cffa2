"""The parent's side of control: started, watched, replaced when it has died or hangs."""

from collections.abc import Callable

from exograv.runtime.control_loop.answering import ControlInterface, ControlJob, control_process
from exograv.runtime.control_loop.exchange import Channels
from exograv.runtime.processes.shared_memory import Mailbox
from exograv.runtime.processes.supervisor import Supervisor

HANGS_TICKS = 2000
"""In which the guard asked and nobody answered, after which a control that is alive is ended and replaced; the arm has
long been coming down. Not a time: a guard whose machine says nothing does not ask."""

FRUITLESS_MAX = 3
"""Controls in a row that ended without one answer; what ends them would end the next one too."""


Build = Callable[[], ControlInterface]


class ControlKeeper:
    """Control's process, and the next one when it has died or hangs; none of them can leave the guard's latch."""

    def __init__(self, first: Build, again: Build, channels: Channels, states: Mailbox, answers: Mailbox):
        """Start the first; all that follow are built by `again`."""
        self._again, self._channels, self._states, self._answers = again, channels, states, answers
        self._seen = self._asked = 0
        self._child = Supervisor("control", control_process, ControlJob(first, channels), FRUITLESS_MAX)
        self._at_start = answers.count

    @property
    def pid(self) -> int:
        """Of the control in charge."""
        return self._child.pid

    @property
    def restarts(self) -> int:
        """Controls that had to be replaced."""
        return self._child.restarts

    def await_ready(self) -> None:
        """Wait until it has built what it needs.

        Raises:
            RigError: It has died.
        """
        self._child.await_ready()

    def check(self) -> None:
        """Replace it if it has died, or does not answer any more. To be called some times a second."""
        answered, asked = self._answers.count, self._states.count
        if answered != self._seen:
            self._seen, self._asked = answered, asked
            self._child.succeeded()
        hangs = answered != self._at_start and asked - self._asked > HANGS_TICKS
        if (not self._child.is_alive or hangs) and self._child.replace(ControlJob(self._again, self._channels)):
            self._asked, self._at_start = asked, self._answers.count

    def close(self) -> None:
        """Say that it is over."""
        self._child.end(2.0, "over")
