"""The worker of an arm that is learned live: takes what control tells, and says what it finds."""

from dataclasses import dataclass

import numpy as np

from exograv.dynamics.machine import CalibratedMachine
from exograv.dynamics.parameters import Parameters
from exograv.identification.core.interface import Estimate, Outcome, Sample
from exograv.identification.core.prior import prior
from exograv.loop.person_limits_manager import LimitsMaker
from exograv.model.assembly import Assembly
from exograv.procedures.identification.estimator_session import Belief, EstimatorSession, table_guess
from exograv.procedures.identification.person_check import PersonCheck
from exograv.procedures.verification.postures import NONE
from exograv.procedures.verification.slow_passes import PassListener, PassSample
from exograv.safety.person import PersonLimits

BRIDGED_TICKS = 20
"""Up to so many missing samples the one after them stands for all; a longer gap breaks the motion off."""

Joints = np.ndarray


@dataclass(frozen=True)
class EstimateReport:
    """What a worker tells once a second: how much is known by now, and how much was before anything moved."""

    motion_s: float
    x: Parameters
    sd: Parameters
    """Of each parameter."""
    left_over: Joints
    """That is predicted, per joint over the workspace, RMS [N·m]."""
    prior: Parameters
    prior_sd: Parameters
    left_over_prior: Joints
    is_contradicted: bool = False
    """Whether the motion speaks against the file that it began with."""


@dataclass(frozen=True)
class LearnedArm:
    """What a worker tells in the end."""

    t: float
    """The rig's clock at the last sample [s]."""
    estimate: Estimate
    outcome: Outcome
    why: str
    stop_s: float | None
    """When the stop rule would have ended the motion [s]."""
    restless_s: float | None
    person: PersonLimits
    """What the guard is to hold this person to."""
    is_led: bool = False
    """Whether the arm is moved on."""


@dataclass(frozen=True)
class PassesResult:
    """What a worker tells after the passes of a verification."""

    t: float
    """The rig's clock at the last sample [s]."""
    heard: tuple[PassSample, ...]
    seconds: float
    """That they took [s]."""
    person: PersonLimits
    """As before."""
    is_led: bool = False
    """The arm is let go."""


class ArmWorker:
    """`Working`: learns the arm by the recursive method, works out what may reach it, and listens to a verification."""

    def __init__(
        self,
        assembly: Assembly,
        machine: CalibratedMachine,
        period_s: float,
        is_verified: bool = False,
        belief: Belief | None = None,
    ):
        """Takes seconds; `belief` is of another day, and is held against the first seconds of motion."""
        self._period_s, self._before = period_s, -np.inf
        self._is_verified, self._learned, self._is_passed = is_verified, None, False
        self._listener, self._begun_at = PassListener(assembly.n, period_s), np.inf
        self._learner = EstimatorSession(assembly, machine, "recursive", period_s, belief)
        self._limits = LimitsMaker(assembly, machine, table_guess(assembly, machine))
        self._check: PersonCheck | None = None
        if belief is not None:
            self._check = PersonCheck(self._learner.model.again(), machine, belief, prior(assembly, machine))
            self._learner.followers.append(self._ask_about)
        self._news: list[EstimateReport] = []

    def news(self) -> list[EstimateReport]:
        """As it was judged since this was last asked."""
        news, self._news = self._news, []
        return news

    def take(self, sample: np.void) -> np.ndarray | None:
        """One sample; what may be published, if it is time."""
        now = float(sample["now"])
        ticks = 1 if np.isinf(self._before) else round((now - self._before) / self._period_s)
        self._before = now
        is_broken = not 0 <= ticks <= BRIDGED_TICKS
        ticks = 1 if is_broken else ticks
        if self._learned is not None:
            self._listen(sample, ticks, is_broken)
            return None
        if is_broken:
            self._learner.interrupt()
        found = None
        for _ in range(ticks):
            estimate = self._learner.take(sample["q"], sample["tau"], sample["q_asked"])
            if estimate is not None:
                found = estimate.x
                if self._learner.is_to_note:
                    self._judge(estimate)
        return found

    def _ask_about(self, sample: Sample) -> None:
        """Whether the file is this person's."""
        if self._check is not None:
            self._check.take(sample)

    def _listen(self, sample: np.void, ticks: int, is_broken: bool) -> None:
        listener, posture = self._listener, int(sample["posture"])
        if is_broken:
            listener.interrupt()
        self._begun_at = min(self._begun_at, self._before)
        if posture != (NONE if listener.posture is None else listener.posture):
            listener.begin(None if posture == NONE else posture)
        for _ in range(ticks):
            listener.take(sample["q"], sample["tau"], sample["q_asked"])

    @property
    def is_over(self) -> bool:
        """Whether nothing follows."""
        return self._is_passed or not self._is_verified

    def finish(self) -> tuple[np.ndarray, LearnedArm | PassesResult]:
        """Parameters, and what the parent is to know."""
        if self._learned is not None:
            self._is_passed = True
            heard, seconds = tuple(self._listener.heard), self._before - self._begun_at
            return self._learned.estimate.x, PassesResult(self._before, heard, seconds, self._learned.person)
        self._learned = self._arm()
        return self._learned.estimate.x, self._learned

    def _judge(self, estimate: Estimate) -> None:
        left_over = self._learner.judge(estimate)
        if left_over is not None:
            is_other = self._check is not None and self._check.is_contradicted
            self._news.append(
                EstimateReport(estimate.t, estimate.x, estimate.sd, left_over, *self._learner.before, is_other)
            )

    def _arm(self) -> LearnedArm:
        estimate = self._learner.last()
        self._judge(estimate)
        found = self._learner.close()
        person = self._limits.known(estimate.x)
        why = (found.outcome, found.why, found.stop_s, found.restless_s)
        return LearnedArm(self._before, estimate, *why, person, self._is_verified)
