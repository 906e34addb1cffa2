"""Seat of a participant in another process: the session's page goes out on a line, touches come back."""

import time
from collections import deque
from collections.abc import Iterator

from pydantic import ValidationError

from exograv.errors import RigError
from exograv.laboratory.participant.screen_session import EventSource, ScreenSession
from exograv.runtime.processes.line_socket import Lines, connected_lines
from exograv.storage.session_checkpoint import LearnedState
from exograv.task.events import Touch
from exograv.task.participant_line import (
    TO_SESSION,
    Introduced,
    Learned,
    Remember,
    Seen,
    ToParticipant,
    ToSession,
    Touched,
)
from exograv.task.picture import ParticipantPicture
from exograv.task.run import TaskRun

INTRODUCED_S = 30.0
"""Time-out for the participant's first message [s]."""

LOST = "The simulated participant has ended: its process no longer answers."


class ParticipantLine:
    """Line to a participant."""

    def __init__(self, port: int):
        """Connect, and wait for the participant's form.

        Raises:
            RigError: No participant listens at the port, or the first message is another one.
        """
        self._lines: Lines = connected_lines(port)
        self.learned: LearnedState | None = None
        """State that the participant has told last."""
        first = self._first()
        if not isinstance(first, Introduced):
            self.close()
            raise RigError(f"The process at port {port} is no participant of a session: it has sent no form.")
        self.introduced = first

    def tell(self, message: ToParticipant) -> None:
        """Send a message.

        Raises:
            RigError: The participant's process has ended.
        """
        self._lines.send(message.model_dump_json())
        if not self._lines.is_open:
            raise RigError(LOST)

    def touches(self) -> Iterator[Touched]:
        """Yield the touches that have arrived, and note what the participant has learned.

        Raises:
            RigError: The participant's process has ended, or has sent something else.
        """
        for line in self._lines.received():
            message = _read(line)
            if isinstance(message, Touched):
                yield message
            elif isinstance(message, Learned):
                self.learned = LearnedState.model_validate(message.learned)
        if not self._lines.is_open:
            raise RigError(LOST)

    def close(self) -> None:
        """Close the line; the participant relaxes."""
        self._lines.close()

    def _first(self) -> ToSession | None:
        until = time.monotonic() + INTRODUCED_S
        while self._lines.is_open and time.monotonic() < until:
            for line in self._lines.received(patience_s=0.1):
                return _read(line)
        return None


class RemoteSeat:
    """`Seat` of a participant at the other end of a line."""

    def __init__(self, line: ParticipantLine, page: str, learned: LearnedState | None):
        """Seat the participant.

        Args:
            line: Line to the participant.
            page: Identifier of the participant's page.
            learned: State of the participant from before an interruption; None without one.
        """
        self._line, self._page = line, page
        self._arrived: deque[Touch] = deque()
        if learned is not None:
            line.learned = learned  # A checkpoint before the first touch must not lose it.
            line.tell(Remember(learned=learned.model_dump()))

    @property
    def is_relaxed(self) -> None:
        """None: the session cannot see the participant's muscles."""
        return None

    def session(self, run: TaskRun, *others: EventSource) -> ScreenSession:
        """Return the session of this participant."""
        return ScreenSession(run, (self._reported, *others), self._see)

    def touch(self, t: float) -> None:
        """Take the touches that have arrived in the tick at `t` [s], and convert their times to the session's clock.

        In lock-step a message arrives in the tick in which it was sent, so the difference is that of the clocks.
        """
        for message in self._line.touches():
            later_s, touch = t - message.now, message.touch
            times = {"t": touch.t + later_s, "received": min(touch.received + later_s, t)}
            self._arrived.append(touch.model_copy(update={**times, "page": self._page}))

    def act(self) -> None:
        """Do nothing: the muscles are in the other process."""

    def _see(self, _t: float, picture: ParticipantPicture) -> None:
        self._line.tell(Seen(picture=picture))

    def _reported(self, _t: float) -> Iterator[Touch]:
        """Yield the touches that have arrived, each once."""
        while self._arrived:
            yield self._arrived.popleft()


def _read(line: str) -> ToSession:
    try:
        return TO_SESSION.validate_json(line)
    except ValidationError as error:
        raise RigError(f"The participant's process has sent a message that is none: {line[:80]}") from error
