"""Result of an identification in a steered session: a wrong file stops the machine, a new estimate is stored."""

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
"""Number of a message without a reply."""

Keep = Callable[[str | None, LearnedArm, np.ndarray], str | None]
"""Callback that stores an identified arm and returns the participant's code.

Its arguments are a code (None for a random one), the estimate, and the predicted residual torque [N·m].
"""


@runtime_checkable
class Learning(Protocol):
    """Part of `WorkerKeeper` that is needed here."""

    judged: EstimateReport | None
    learned: LearnedArm | None


class EstimateKeeper:
    """Storage of the estimate of one set of processes."""

    def __init__(self, who: RequestedParticipant):
        """Start without an estimate."""
        self._who, self._is_done = who, False
        self.code = who.participant
        """Code of the file in force, or of the file that was written; absent if there is none."""
        self.is_contradicted = False
        """True if the motion contradicts the file, or the form of an unknown person."""
        self.wrong: tuple[str, ...] = ()
        """Sentences for the operator."""

    def look(self, worker: Learning | None, send: Callable[[object], object], keep: Keep) -> None:
        """Check the worker, several times per second. `send` passes a message to the guard."""
        if worker is None or worker.judged is None or self._is_done:
            return
        if worker.judged.is_contradicted or worker.judged.refusal:
            self._is_done = self.is_contradicted = True
            why = say("flight.other_person", person=self._who.participant)
            if worker.judged.refusal:
                why = say("flight.other_form", why=worker.judged.refusal)
            self.wrong = (why,)
            with contextlib.suppress(OSError):
                send(DescentCommand(PRESSED))
        elif worker.learned is not None:
            self._is_done = True
            try:
                self.code = keep(self._who.code, worker.learned, worker.judged.left_over) or self.code
            except ExogravError as error:
                self.wrong = (str(error),)
