"""Clock of a machine of drives: this computer's clock, or a count of periods in lock-step with simulated drives."""

import time

from exograv.errors import RigError

LOCK_STEP_S = 8.0
"""Time-out for an answer of simulated drives in lock-step [s]. A busy computer may halt their process for seconds, and
in lock-step no time passes meanwhile. After 10 s without a tick the parent kills the guard
(`live.live_processes.HANGS_S`)."""

ENDED = (
    f"The simulated drives have not answered for {LOCK_STEP_S:g} s: their process has ended, or this computer is too "
    "busy. Close other programs. Then repeat the command, and start `exograv dev drive-sim` again if it was your own."
)


class DrivesEndedError(RigError):
    """Simulated drives in lock-step that do not answer any more. Nothing is left to lower."""


class Clock:
    """Clock that is 0 when it is made."""

    def __init__(self, period_s: float, lock_step: bool):
        self.period_s, self.is_in_lock_step = period_s, lock_step
        self.ticks = 0
        self.nobody_answers = False
        """Set by examiners in lock-step after they have disconnected the cable: no answer is expected then."""
        self._began = time.monotonic()

    @property
    def t(self) -> float:
        """Time since the clock was made [s]."""
        return self.ticks * self.period_s if self.is_in_lock_step else time.monotonic() - self._began

    def tick(self) -> float:
        """Count the start of a period and return its time [s]."""
        self.ticks += 1
        return self.t
