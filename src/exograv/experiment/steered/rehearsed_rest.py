"""Rest of a rehearsal in which a machine would move the arm: its phases for the pages, without a machine."""

import math

from exograv.procedures.identification.rest_learning import REST_MOTION_S
from exograv.procedures.identification.rest_text import RestPhase, phase_text
from exograv.safety.guard import GRAVITY_LEVEL_S
from exograv.safety.modes import Mode

from .rest_stages import STAGES
from .sentences import say
from .view_models import RestLearning, WorkProgress

PHASES = (
    (RestPhase.WEIGHT, GRAVITY_LEVEL_S),
    (RestPhase.WAY, 4.0),
    (RestPhase.MOVES, REST_MOTION_S),
    (RestPhase.BACK, 4.0),
    (RestPhase.LEARNS, 5.0),
)
"""Phases of a rest with their durations [s], about those of a machine."""

WHOLE_S = sum(seconds for _, seconds in PHASES)
MOTION_S = WHOLE_S - GRAVITY_LEVEL_S
GOES_ON_IN = frozenset({Mode.FLOATING, Mode.MOVING})


class RehearsedRest:
    """Rests of one person in a rehearsal."""

    def __init__(self) -> None:
        """Begin without a rest."""
        self._begun_s, self._done_s, self._rests = -math.inf, 0.0, 0
        self.is_active = False

    def begin(self, t: float) -> None:
        """Begin a rest at time `t` [s]."""
        self.is_active, self._begun_s, self._done_s = True, t, 0.0

    def step(self, t: float, mode: Mode) -> bool:
        """Advance to time `t` [s]; return True if the machine moves or holds the arm in this rest.

        A mode in which the arm is not carried ends the rest, which then counts no motion.
        """
        self._done_s = t - self._begun_s
        is_over = self._done_s >= WHOLE_S
        if self.is_active and (is_over or mode not in GOES_ON_IN):
            self.is_active = False
            self._rests += is_over
        return self.is_active and self._phase is not RestPhase.WEIGHT

    def view(self, why_not: str) -> RestLearning:
        """Rests for the pages; `why_not` is the reason why none can begin."""
        return RestLearning(
            is_active=self.is_active,
            why_not=say("rest.runs") if self.is_active else why_not,
            rests=self._rests,
            motion_s=self._rests * REST_MOTION_S,
            sentences=(say("rehearsal.rest"),),
            stage=STAGES[self._phase] if self.is_active else None,
            moves_s=REST_MOTION_S,
        )

    def work(self) -> WorkProgress | None:
        """Progress of the rest; None without one."""
        if not self.is_active:
            return None
        is_weight = self._phase is RestPhase.WEIGHT
        share = 0.0 if is_weight else (self._done_s - GRAVITY_LEVEL_S) / MOTION_S
        left_s = None if is_weight else (1.0 - share) * MOTION_S
        return WorkProgress(
            kind="rest", phase=phase_text(self._phase), joint=None, share_done=share, left_s=left_s,
            why=say("work.rest"),
        )  # fmt: skip

    @property
    def _phase(self) -> RestPhase:
        ends_s = 0.0
        for phase, seconds in PHASES:
            ends_s += seconds
            if self._done_s < ends_s:
                return phase
        return RestPhase.FLOATS
