"""What becomes of the person who is put in: a file that is somebody else's stops, and who was learned is kept."""

import contextlib
from collections.abc import Callable
from typing import Protocol, runtime_checkable

import numpy as np

from exograv.errors import ExogravError
from exograv.live.arm_worker import EstimateReport, LearnedArm
from exograv.runtime.control_loop.steering import DescentCommand

from .participants import RequestedParticipant
from .sentences import say

PRESSED = -1
"""Number of a word that nobody waits for."""

Keep = Callable[[str | None, LearnedArm, np.ndarray], str | None]
"""Writes the file under a code, or a random one; takes what was found, and what is predicted to be left over [N·m]."""


@runtime_checkable
class Learning(Protocol):
    """As `WorkerKeeper`."""

    judged: EstimateReport | None
    learned: LearnedArm | None


class EstimateKeeper:
    """Of one set of processes."""

    def __init__(self, who: RequestedParticipant):
        """Nobody has been moved yet."""
        self._who, self._is_done = who, False
        self.code = who.participant
        """Of the file in force, or of the one that was written; absent where there is none."""
        self.is_contradicted = False
        """Whether the motion speaks against the file."""
        self.wrong: tuple[str, ...] = ()
        """What somebody should know."""

    def look(self, worker: Learning | None, send: Callable[[object], object], keep: Keep) -> None:
        """Some times a second; `send` goes to the guard."""
        if worker is None or worker.judged is None or self._is_done:
            return
        if worker.judged.is_contradicted:
            self._is_done = self.is_contradicted = True
            self.wrong = (say("flight.other_person", person=self._who.participant),)
            with contextlib.suppress(OSError):
                send(DescentCommand(PRESSED))
        elif worker.learned is not None:
            self._is_done = True
            try:
                self.code = keep(self._who.code, worker.learned, worker.judged.left_over) or self.code
            except ExogravError as error:
                self.wrong = (str(error),)
