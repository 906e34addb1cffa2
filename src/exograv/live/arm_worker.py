"""Worker process of live identification: it takes samples from control, and reports estimates of the arm."""

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from exograv.dynamics.machine import CalibratedMachine
from exograv.dynamics.parameters import Parameters
from exograv.identification.core.carried_arm import CarriedArm
from exograv.identification.core.interface import Estimate, Outcome, Sample
from exograv.identification.core.prior import prior
from exograv.loop.bridged_listener import BRIDGED_TICKS, between
from exograv.loop.person_limits_manager import LimitsMaker
from exograv.model.arm import is_plausible
from exograv.model.assembly import Assembly
from exograv.procedures.identification.check_motion import PlannedCheck
from exograv.procedures.identification.estimator_session import Belief, EstimatorSession, table_guess
from exograv.procedures.identification.identify import IMPLAUSIBLE
from exograv.procedures.identification.person_check import PersonCheck
from exograv.procedures.verification.postures import NONE
from exograv.procedures.verification.slow_passes import PassListener, PassSample
from exograv.procedures.weighing.arm_check import ArmCheck
from exograv.procedures.weighing.form_check import FormCheck
from exograv.safety.limits import PersonLimits

Joints = np.ndarray


@dataclass(frozen=True)
class EstimateReport:
    """Message of a worker once a second: the present estimate, and the prior before any motion."""

    motion_s: float
    x: Parameters
    sd: Parameters
    """Standard deviation of each parameter."""
    left_over: Joints
    """Predicted left over per joint, RMS over the workspace [N·m]."""
    prior: Parameters
    prior_sd: Parameters
    left_over_prior: Joints
    is_contradicted: bool = False
    """True if the motion contradicts the participant's file that the estimate began with."""
    refusal: str = ""
    """Verdict that refuses the form of an unknown person; empty without one."""


@dataclass(frozen=True)
class LearnedArm:
    """Message of a worker at the end of the identification."""

    t: float
    """Time of the last sample on the rig's clock [s]."""
    estimate: Estimate
    carried: CarriedArm
    """Arm that the machine carries while it floats."""
    outcome: Outcome
    why: str
    stop_s: float | None
    """Time at which the stop rule would have ended the motion [s]; None if it would not have ended it."""
    restless_s: float | None
    person: PersonLimits
    """Limits that the guard must apply to this person."""
    is_led: bool = False
    """True if the machine continues to move the arm."""
    check: ArmCheck | None = None
    """Check of the arm against the form; None for a known person, and without a form."""

    @property
    def floated(self) -> Estimate:
        """Estimate with the parameters that the machine carries."""
        return self.carried.of(self.estimate)


@dataclass(frozen=True)
class PassesResult:
    """Message of a worker after the passes of a verification."""

    t: float
    """Time of the last sample on the rig's clock [s]."""
    heard: tuple[PassSample, ...]
    seconds: float
    """Duration of the passes [s]."""
    person: PersonLimits
    """Limits of the person, unchanged by the passes."""
    is_led: bool = False
    """True if the machine moves the arm; always False here."""


class ArmWorker:
    """Recursive identification of the arm, limits of the person, and samples of a verification; a `Working`."""

    def __init__(
        self,
        assembly: Assembly,
        machine: CalibratedMachine,
        period_s: float,
        is_verified: bool = False,
        belief: Belief | None = None,
        body_mass_kg: float | None = None,
        check: PlannedCheck | None = None,
    ):
        """Prepare the estimator, which takes seconds.

        `belief` comes from an earlier day. The first seconds of motion test if it fits this person. Without it the arm
        is compared with the form's `body_mass_kg`, if there is one. A `check` at the end of the motion tests the
        estimate.
        """
        self._period_s, self._before = period_s, -np.inf
        self._sample_before = np.zeros((3, assembly.n))
        self._is_verified, self._learned, self._is_passed = is_verified, None, False
        self._listener, self._begun_at = PassListener(assembly.n, period_s), np.inf
        self._learner = EstimatorSession(assembly, machine, "recursive", period_s, belief)
        self._learner.check = check
        self._arm_of_table, self._table = assembly.arm, table_guess(assembly, machine)
        self._limits = LimitsMaker(assembly, machine, self._table)
        self._check: PersonCheck | None = None
        if belief is not None:
            self._check = PersonCheck(self._learner.model.again(), machine, belief, prior(assembly, machine))
            self._learner.followers.append(self._ask_about)
        self._form: FormCheck | None = None
        if belief is None and body_mass_kg is not None:
            self._form = FormCheck(self._learner.model.again(), body_mass_kg)
            self._learner.followers.append(self._form)
        self._news: list[EstimateReport] = []

    def news(self) -> list[EstimateReport]:
        """Return the reports since the last call."""
        news, self._news = self._news, []
        return news

    def take(self, sample: np.void) -> np.ndarray | None:
        """Take one sample; return the parameters if a new estimate may be published."""
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
        for q, tau, q_asked in self._interpolated(sample, ticks):
            x = self._learner.take(q, tau, q_asked)
            if x is not None:
                found = x
                if self._learner.is_to_note:
                    self._judge(self._learner.estimate())
        return found

    def _interpolated(self, sample: np.void, ticks: int) -> Iterator[np.ndarray]:
        """Yield position, torque and requested position (3, joint) of each tick since the sample before."""
        now, before = np.array([sample["q"], sample["tau"], sample["q_asked"]]), self._sample_before
        self._sample_before = now
        for tick in range(1, ticks):
            yield between(before, now, tick / ticks)
        yield now

    def _ask_about(self, sample: Sample) -> None:
        """Use one sample for the check that the loaded file describes the person in the machine."""
        if self._check is not None:
            self._check.take(sample)

    def _listen(self, sample: np.void, ticks: int, is_broken: bool) -> None:
        listener, posture = self._listener, int(sample["posture"])
        if is_broken:
            listener.interrupt()
        self._begun_at = min(self._begun_at, self._before)
        if posture != (NONE if listener.posture is None else listener.posture):
            listener.begin(None if posture == NONE else posture)
        for q, tau, q_asked in self._interpolated(sample, ticks):
            listener.take(q, tau, q_asked)

    @property
    def is_over(self) -> bool:
        """True if no further message follows."""
        return self._is_passed or not self._is_verified

    def finish(self) -> tuple[np.ndarray, LearnedArm | PassesResult]:
        """Return the parameters and the final message for the parent process."""
        if self._learned is not None:
            self._is_passed = True
            heard, seconds = tuple(self._listener.heard), self._before - self._begun_at
            return self._learned.carried.x, PassesResult(self._before, heard, seconds, self._learned.person)
        self._learned = self._arm()
        return self._learned.carried.x, self._learned

    def _judge(self, estimate: Estimate) -> None:
        left_over = self._learner.judge(estimate)
        if left_over is not None:
            is_other = self._check is not None and self._check.is_contradicted
            refusal = "" if self._form is None else self._form.refusal
            self._news.append(
                EstimateReport(estimate.t, estimate.x, estimate.sd, left_over, *self._learner.before, is_other, refusal)
            )

    def _arm(self) -> LearnedArm:
        estimate = self._learner.last()
        self._judge(estimate)
        found = self._learner.close()
        if self._form is not None:
            self._form.finish(found.restless_s is not None)
            self._news = [replace(one, refusal=self._form.refusal) for one in self._news]
        # Control refuses an implausible arm. The guard then expects the table's arm, and lets down any other one.
        carried = found.decided
        is_taken = is_plausible(self._arm_of_table, carried.x)
        person = self._limits.known(carried.x if is_taken else self._table)
        reason = found.why if is_taken else f"{IMPLAUSIBLE} {found.why}"
        why = (found.outcome, reason, found.stop_s, found.restless_s)
        verdict = None if self._form is None else self._form.verdict
        return LearnedArm(self._before, found.last, carried, *why, person, self._is_verified, verdict)
