"""Judgement of identification runs on one wearer in one calibrated machine."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from jaxtyping import Bool, Float

from exograv.dynamics.machine import CalibratedMachine
from exograv.dynamics.parameters import ParameterLayout
from exograv.identification.core.arm_model import ArmModel
from exograv.identification.core.carried_arm import CarriedArm, widened_by_check
from exograv.identification.core.interface import Covariance, Estimate, Outcome
from exograv.identification.core.left_over import LeftOverPrediction, StopRule, is_restless
from exograv.identification.core.prior import prior
from exograv.laboratory.result_rows import parameter_rows
from exograv.laboratory.truth_score import Examination
from exograv.laboratory.virtual_laboratory import VirtualLaboratory
from exograv.model.assembly import Assembly
from exograv.model.tree import is_physical
from exograv.procedures.identification.estimator_session import arm_to_carry, table_guess
from exograv.recording.rounding import rounded

from .cases import Case
from .runs import Intervals, MethodRun, Setting
from .stream_replay import DURATIONS_S, MethodTrace

COVERAGE_SD = 1.96


@dataclass(frozen=True)
class StopVerdict:
    """Verdict of the stop rule."""

    outcome: Outcome
    stop_s: float | None
    restless_s: float | None
    """First time at which the wearer was seen not to relax [s of motion]."""


@dataclass
class WearerJudge:
    """Examiner of every method on one wearer in one calibrated machine."""

    case: Case
    assembly: Assembly
    machine: CalibratedMachine
    laboratory: VirtualLaboratory
    """Machine and wearer with their truth; no method may read them."""

    @cached_property
    def model(self) -> ArmModel:
        """Model of this arm in this machine; each method works on a copy made by `again`."""
        return ArmModel(self.assembly, self.machine)

    @cached_property
    def _examination(self) -> Examination:
        return Examination(self.laboratory, self.assembly, self.machine)

    @cached_property
    def _prior_mean(self) -> Float[np.ndarray, " parameter"]:
        return prior(self.assembly, self.machine)[0]

    @cached_property
    def _prediction(self) -> LeftOverPrediction:
        return LeftOverPrediction(self.model.again(), self._prior_mean)

    def judge_run(
        self, setting: Setting, name: str, trace: MethodTrace, verdict: StopVerdict | None = None
    ) -> MethodRun:
        """Examine every estimate of a run; apply the stop rule too where no verdict of the loop is given."""
        verdict = verdict or self._verdict(trace)
        estimates, last = trace.estimates, trace.estimates[-1]
        stated, carried = self._prediction.of(last), self._carried(last, trace)
        return MethodRun(
            setting,
            name,
            self.case,
            list(self.assembly.description.places),
            t=[round(estimate.t, 3) for estimate in estimates],
            left_over_Nm=[self._left_over(estimate) for estimate in estimates],
            possible_share=float(np.mean([self._is_possible(estimate) for estimate in estimates])),
            intervals=self._intervals(estimates),
            outcome=verdict.outcome.name,
            stated_Nm=None if stated is None else rounded(stated),
            check_p=None if trace.agreement is None else [round(p, 5) for p in trace.agreement.p.tolist()],
            carried_share=rounded(carried.share),
            carried_Nm=rounded(self._examination.score(carried.x).total) if np.isfinite(carried.x).all() else None,
            table_Nm=rounded(self._examination.score(table_guess(self.assembly, self.machine)).total),
            stop_s=_tenths(verdict.stop_s),
            restless_s=_tenths(verdict.restless_s),
            rejected_share=round(last.rejected_share, 4),
            noise_scale=round(last.noise_scale, 3),
            update_us=_percentiles(trace.update_us),
            estimate_us=_percentiles(trace.estimate_us),
            work_share=round(trace.work_share, 5),
            method_s=round(trace.method_s, 3),
        )

    def _carried(self, last: Estimate, trace: MethodTrace) -> CarriedArm:
        """Decide as a session does how much of the last estimate a machine would carry."""
        last = widened_by_check(last, self._prediction, trace.agreement)
        return arm_to_carry(last, self.assembly, self.machine, self._prediction)

    def _left_over(self, estimate: Estimate) -> list[float | None]:
        if not np.isfinite(estimate.x).all():
            return [None] * self.assembly.n
        total = self._examination.score(estimate.x).total
        return [round(value, 4) if np.isfinite(value) else None for value in total.tolist()]

    def _is_possible(self, estimate: Estimate) -> bool:
        bodies = ParameterLayout.of(self.assembly).bodies
        return bool(np.isfinite(estimate.x).all()) and all(is_physical(estimate.x[body]) for body in bodies)

    def _intervals(self, estimates: Sequence[Estimate]) -> dict[str, Intervals]:
        found = {}
        for seconds in DURATIONS_S:
            estimate = latest(estimates, seconds)
            if estimate is not None and estimate.covariance is not None and np.isfinite(estimate.x).all():
                torque = self._covered_torque(estimate, estimate.covariance)
                found[f"{seconds:g}"] = Intervals(self._covered_parameters(estimate), torque)
        return found

    def _covered_parameters(self, estimate: Estimate) -> dict[str, bool]:
        rows = parameter_rows(self.assembly, self._prior_mean, estimate, self.laboratory.wearer)
        return {row.name: row.ci95[0] <= row.truth <= row.ci95[1] for row in rows if row.ci95 is not None}

    def _covered_torque(self, estimate: Estimate, covariance: Covariance) -> tuple[int, int]:
        """Count the intervals that hold the arm's torque, over held-out postures and joints, and all intervals."""
        error = self._examination.arm_error(estimate.x)
        model = self.model.again()
        rows = np.array([model.at_rest(q, estimate.x)[1] for q in self._examination.postures])
        rows[:, :, self._not_of_the_arm] = 0.0
        variance = np.einsum("pji,ik,pjk->pj", rows, covariance, rows, optimize=True)
        sd = np.sqrt(np.maximum(variance, 0.0))
        return int((np.abs(error) <= COVERAGE_SD * sd).sum()), error.size

    @cached_property
    def _not_of_the_arm(self) -> Bool[np.ndarray, " parameter"]:
        layout = ParameterLayout.of(self.assembly)
        outside = np.ones(layout.count, dtype=bool)
        outside[layout.phi] = outside[layout.fit] = False
        return outside

    def _verdict(self, trace: MethodTrace) -> StopVerdict:
        """Apply the stop rule to the estimates as a session does."""
        estimates, description = trace.estimates, self.assembly.description
        restless_s = next((estimate.t for estimate in estimates if is_restless(estimate)), None)
        rule = StopRule(description.places, description.joints)
        outcome, stop_s = Outcome.RUNNING, None
        for estimate in estimates:
            predicted = self._prediction.of(estimate)
            if predicted is not None and outcome is Outcome.RUNNING:
                outcome, stop_s = rule.judge(estimate, predicted), estimate.t
        last, predicted = estimates[-1], self._prediction.of(estimates[-1])
        if outcome is Outcome.RUNNING:
            states_none = Outcome.NO_INTERVAL if predicted is None else Outcome.TIME_IS_UP
            outcome, stop_s = Outcome.NOT_RELAXED if is_restless(last) else states_none, None
        if predicted is not None:
            outcome = rule.final(outcome, last, predicted, trace.agreement)
        return StopVerdict(outcome, stop_s, restless_s)


def _tenths(seconds: float | None) -> float | None:
    return None if seconds is None else round(seconds, 1)


def latest(estimates: Sequence[Estimate], seconds: float) -> Estimate | None:
    """Return the last estimate of the first `seconds` of motion, plus the start of the filter; None without one."""
    within = [estimate for estimate in estimates if estimate.t <= seconds + 0.01]
    return within[-1] if within else None


def _percentiles(update_us: Float[np.ndarray, " update"]) -> dict[str, float] | None:
    if not len(update_us):
        return None
    p50, p99 = np.percentile(update_us, [50, 99])
    return {"p50": round(float(p50), 2), "p99": round(float(p99), 2), "max": round(float(update_us.max()), 1)}
