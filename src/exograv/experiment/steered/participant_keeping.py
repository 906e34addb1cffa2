"""Result of an identification in a steered session: a wrong file stops the machine, a new estimate is stored."""

import contextlib
from collections.abc import Callable
from typing import Protocol, runtime_checkable

import numpy as np

from exograv.errors import ExogravError
from exograv.live.arm_worker import EstimateReport, LearnedArm
from exograv.procedures.identification.participant_session import KeptParticipant, NotKept
from exograv.runtime.control_loop.steering import DescentCommand
from exograv.sentence import Sentence
from exograv.storage.session_checkpoint import CheckedArm

from .participants import RequestedParticipant
from .sentences import say

PRESSED = -1
"""Number of a message without a reply."""

Keep = Callable[[str | None, LearnedArm, np.ndarray], str | None]
"""Callback that stores an identified arm and returns the participant's code.

Its arguments are a code (None for a random one), the estimate, and the predicted residual torque [N·m].
"""

KeepRests = Callable[[str | None, CheckedArm, bool], KeptParticipant | NotKept | None]
"""Callback that stores an arm from rests, and returns the result; None without a folder of files.

Its arguments are a code (None for a random one), the estimate, and True if the file is of the present donning.
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
        self._who, self._is_done, self._is_of_donning = who, False, False
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
                code = keep(self._who.code, worker.learned, worker.judged.left_over)
            except ExogravError as error:
                self.wrong = (str(error),)
            else:
                self.code, self._is_of_donning = code or self.code, code is not None

    def keep_rests(self, learned: CheckedArm, keep: KeepRests) -> Sentence | None:
        """Store an arm that the rests have shown; return a sentence for the operator, None without a folder of files.

        A failure is told and ends nothing. The next rest writes all that the rests have shown.
        """
        try:
            written = keep(self.code or self._who.code, learned, self._is_of_donning)
        except (ExogravError, OSError) as error:
            return say("rest.not_stored", why=str(error))
        if isinstance(written, KeptParticipant):
            self.code, self._is_of_donning = written.code, True
            return say("rest.stored_refuted" if written.warning else "rest.stored", person=written.code)
        return None if written is None else say("rest.kept_before")
