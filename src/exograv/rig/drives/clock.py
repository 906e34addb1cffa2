"""The clock of a machine of drives: this computer's, or periods that are counted while simulated drives wait for us."""

import time

LOCK_STEP_S = 5.0
"""For an answer of simulated drives that wait for us as we for them [s]."""

ENDED = "The simulated drives do not answer any more: they have ended. Begin them again."


class Clock:
    """Begins with 0 when it is made."""

    def __init__(self, period_s: float, lock_step: bool):
        self.period_s, self.is_in_lock_step = period_s, lock_step
        self.ticks = 0
        self.nobody_answers = False
        """For examiners in lock-step: they have taken the cable out, so that nobody is waited for."""
        self._began = time.monotonic()

    @property
    def t(self) -> float:
        """So long since it was made [s]."""
        return self.ticks * self.period_s if self.is_in_lock_step else time.monotonic() - self._began

    def tick(self) -> float:
        """A period begins; its time [s]."""
        self.ticks += 1
        return self.t
