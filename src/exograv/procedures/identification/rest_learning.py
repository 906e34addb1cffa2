"""Learning in rests: the machine moves the relaxed arm between two windows, and one estimate runs through all rests."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from enum import Enum

import numpy as np

from exograv import motion
from exograv.dynamics.parameters import ParameterLayout
from exograv.identification.core.arm_model import ArmModel
from exograv.identification.core.carried_arm import BodyTable, CarriedArm, carried_arm, widened_by_check
from exograv.identification.core.interface import (
    Agreement,
    Covariance,
    Estimate,
    Joints,
    Outcome,
    Parameters,
    Sample,
)
from exograv.identification.core.left_over import TARGET_NM, LeftOverPrediction, StopRule, is_restless
from exograv.identification.core.muscle_signals import MuscleSignals
from exograv.identification.core.prior import prior
from exograv.identification.recursive.previous_session import carried_over, kept_part
from exograv.identification.recursive.recursive import LEAST_FIT, Recursive
from exograv.loop.arm_controller import ArmController
from exograv.loop.mode_ramp import fade
from exograv.loop.phases import REST_LEARNING
from exograv.loop.pilot import Pilot
from exograv.model.arm import is_plausible
from exograv.model.assembly import Assembly
from exograv.model.rig_settings import Excitation
from exograv.motion import Harmonics, Trajectory
from exograv.storage.rests_so_far import RestsSoFar
from exograv.storage.session_checkpoint import CheckedArm, KeptArm, KeptRests, KnownPerson

from .estimator_session import Belief, build_method
from .identify import planned_excitation
from .muscle_source import MuscleSource
from .sample_observers import HeldOutError
from .session_watch import MeansListener

REST_MOTION_S = 10.0
"""Duration of the driven motion in a rest [s], without the way to its start."""

SHIFT = (np.sqrt(5.0) - 1.0) / 2.0
"""Share of the excitation's period between the starts of two motions [-]. Multiples of the golden section fill the
period evenly after any number of rests."""

APART_S = 15.0
"""Time between the motions of two rests, as the estimator counts it [s]. The wearer's slow torque is forgotten by
then."""

LEFT_OUT_SHARE = 0.25
"""Share of the rests that may be left out as restless [-], assumed. What repeats more often is usual for this wearer in
this machine. The filter's slow torque then widens the intervals."""

CHECK_POSTURES = 4
"""Number of postures of a motion at which the estimate from before is checked [-], as at the end of identification."""


class Verdict(Enum):
    """Decision after a rest; the value is a sentence for the operator."""

    TAKEN = "The model of the arm was renewed."
    CONFIRMED = "The model stays: the new one is not better, and by this rest the model in force is more certain."
    NO_BETTER = "The model stays: the new one is not more certain."
    DISAGREES = "The model stays: the motion contradicts earlier rests. Ask the person to relax, and check the cuffs."
    BEGINS_AGAIN = "The model stays: two rests contradict the earlier ones. Check the cuffs. The machine learns again."
    RESTLESS = "The model stays: the person did not relax. This rest is not used. Ask the person to relax in the rests."
    IMPLAUSIBLE = "The model stays: the new arm is not plausible. Check the cuffs and the body data."


FOR_FILE = frozenset({Verdict.TAKEN, Verdict.CONFIRMED, Verdict.NO_BETTER, Verdict.DISAGREES})
"""Verdicts after which the participant's file gets the estimate."""


@dataclass(frozen=True)
class RestLearned:
    """Result of one rest."""

    verdict: Verdict
    motion_s: float
    """Driven motion of all rests that the estimate uses [s]."""
    estimate: Estimate
    before_Nm: Joints
    """Residual torque that the carried arm stated before the rest [N·m]."""
    carried: CarriedArm
    """Decision to float for the estimate, with the arm at the start of the session in place of the table's."""
    stated_Nm: Joints
    """Residual torque that the carried arm states after the rest [N·m]."""
    agreement: Agreement | None
    """Check of the estimate before the motion by the motion; None without enough motion before."""


class RestLearner:
    """Running estimate of one arm over the rests of a session."""

    def __init__(
        self, model: ArmModel, x: Parameters, belief: Belief | None = None, muscles: MuscleSignals | None = None
    ):
        """Start from the arm that is carried.

        Args:
            model: Model of this arm in this machine.
            x: Parameters that the machine carries.
            belief: Mean and covariance from an identification or from the participant's file; None for the table's.
            muscles: Signals of the muscles that the samples bring; None without.
        """
        self._model, self._table = model.again(), prior(model.assembly, model.machine)
        self._muscles = muscles
        self._belief: Belief = self._table if belief is None else belief
        self._bodies = ParameterLayout.of(model.assembly).bodies
        self._prediction = LeftOverPrediction(model.again(), x)
        """Prediction for the decision, linearised halfway between start and estimate. The cuffs' strain is nearly
        quadratic in the parameters, so this derivative gives the torque between the two. The derivative at the start
        misses most of a strain that the estimate alone contains."""
        self._start, self.x, away = BodyTable(x, self._belief[1]), x, x - self._belief[0]
        self.covariance: Covariance = self._belief[1] + np.outer(away, away)
        """Mean square error of `x`, the carried parameters."""
        self.rests = 0
        """Number of motions so far."""
        description = model.assembly.description
        self._target = np.array([TARGET_NM[place] for place in description.places])
        self._rule = StopRule(description.places, description.joints)
        self._is_contradicted = False
        self._left_out = 0
        """Number of restless motions that the estimate does not use."""
        self._before_s = 0.0
        """Motion that the belief contains [s], from before an interruption."""
        self._checked: CheckedArm | None = None
        self._checked_before: CheckedArm | None = None
        """Estimate for the participant's file before the last rest."""
        self._begin()
        self.kept = self._kept(self._belief, 0.0)
        """State for the checkpoint, as of the last rest."""

    @classmethod
    def continued(
        cls, model: ArmModel, person: KnownPerson, kept: KeptRests, muscles: MuscleSignals | None = None
    ) -> "RestLearner":
        """Continue after an interruption: the estimate so far is the belief, and its samples are gone."""
        learner = cls(model, np.array(person.x), kept.estimate.arrays, muscles)
        learner._start, learner.covariance = BodyTable(*kept.start.arrays), np.array(person.covariance)
        learner.count_on(RestsSoFar(kept.rests, kept.left_out, kept.motion_s))
        learner._is_contradicted = kept.is_contradicted
        learner._checked = learner._checked_before = kept.checked
        learner.kept = kept
        return learner

    def _begin(self) -> None:
        assembly, machine = self._model.assembly, self._model.machine
        method = build_method("recursive", assembly, machine, self._model.again(), self._belief, self._muscles)
        assert isinstance(method, Recursive)
        self._method, self._count, self._motion_s, self._end_t = method, 0, self._before_s, 0.0
        self._used: list[Sequence[Sample]] = []
        """Samples of the estimate, by rest."""

    @property
    def stated_Nm(self) -> Joints:
        """Residual torque that the carried arm states [N·m]."""
        return self._prediction.rms(self.covariance)

    @property
    def so_far(self) -> RestsSoFar:
        """Number and motion of the rests so far."""
        return RestsSoFar(self.rests, self._left_out, self._motion_s)

    def count_on(self, before: RestsSoFar) -> None:
        """Count on from the rests of an earlier part of the session, whose motion the belief contains."""
        self.rests, self._left_out = before.rests, before.left_out
        self._before_s = self._motion_s = before.motion_s
        self.kept = self._kept(self._belief, self._motion_s)

    def keep(self, x: Parameters, covariance: Covariance) -> None:
        """Note that the machine carries these parameters: it refused those of the last rest, as must the file."""
        self.x, self.covariance, self._checked = x, covariance, self._checked_before
        self.kept = self.kept.model_copy(update={"checked": self._checked})

    def path(self, dt: float, seconds: float = REST_MOTION_S) -> Trajectory:
        """Return the motion of the coming rest as a table."""
        return rest_motion(self._model.assembly, self.rests, dt, seconds).table()

    def learn(self, samples: Sequence[Sample]) -> RestLearned:
        """Learn from the motion of a rest, and decide which arm is carried from then on.

        The new arm is taken if it is plausible, the motion agrees with the estimate from before, and its
        stated residual torque over the target, RMS over the axes, is smaller than what the new estimate states of the
        carried arm. If it is not, the carried arm may still be more certain than before. A second contradiction in a
        row begins the estimate anew. A restless motion is left out of the estimate, up to `LEFT_OUT_SHARE` of the
        rests; if the muscles are measured, none is.
        """
        before_Nm = self.stated_Nm
        self.rests += 1
        agreement = self._take(samples)
        found = self._estimate()
        if is_plausible(self._model.assembly.arm, found.x):
            self._prediction = LeftOverPrediction(self._model.again(), 0.5 * (self._start.x + found.x))
        estimate = widened_by_check(found, self._prediction, agreement)
        carried = carried_arm(estimate, self._start, self._prediction, self._bodies)
        verdict = self._judged(estimate, carried, agreement)
        motion_s = self._motion_s
        if verdict is Verdict.TAKEN and carried.covariance is not None:
            self.x, self.covariance = carried.x, carried.covariance
        if verdict is Verdict.CONFIRMED:
            self.covariance = self._of_carried_by(estimate)
        if verdict is Verdict.BEGINS_AGAIN:
            self._forget(samples)
        if verdict is Verdict.RESTLESS:
            self._leave_out_last()
        self._is_contradicted = verdict is Verdict.DISAGREES
        self._note(verdict, estimate, agreement)
        return RestLearned(verdict, motion_s, estimate, before_Nm, carried, self.stated_Nm, agreement)

    def _take(self, samples: Sequence[Sample]) -> Agreement | None:
        """Feed the samples; the ones after enough motion test the estimate."""
        begins = self._end_t + APART_S if self._count else 0.0
        self._held_out = HeldOutError(self._model.again(), lambda: self._method.estimate().x)
        held_from = max(LEAST_FIT + 1 - self._count, 0)
        for k, sample in enumerate(samples):
            if k == held_from:
                self._method.hold_out(check_postures(samples[k:]))
            moved = replace(sample, t=begins + sample.t)
            self._held_out(moved)
            self._method.update(moved)
        self._used.append(samples)
        self._count += len(samples)
        self._motion_s, self._end_t = self._motion_s + samples[-1].t, begins + samples[-1].t
        agreement = self._method.agreement() if len(samples) > held_from else None
        self._method.relinearise()
        return agreement

    def _estimate(self) -> Estimate:
        return replace(self._method.estimate(), t=self._motion_s)

    def _judged(self, estimate: Estimate, carried: CarriedArm, agreement: Agreement | None) -> Verdict:
        # Measured muscles explain a part of the unrest, and the intervals contain the rest of it.
        is_left_out = self._muscles is None and is_restless(estimate)
        if is_left_out and self._left_out < LEFT_OUT_SHARE * self.rests:
            return Verdict.RESTLESS
        if agreement is not None and not agreement.holds:
            return Verdict.BEGINS_AGAIN if self._is_contradicted else Verdict.DISAGREES
        if not is_plausible(self._model.assembly.arm, carried.x):
            return Verdict.IMPLAUSIBLE
        if carried.covariance is None or estimate.covariance is None:
            return Verdict.NO_BETTER
        arms = carried.covariance, self._of_carried_by(estimate), self.covariance
        new, stays, before = (np.square(self._prediction.rms(one) / self._target).sum() for one in arms)
        if new < stays:
            return Verdict.TAKEN
        return Verdict.CONFIRMED if stays < before else Verdict.NO_BETTER

    def _of_carried_by(self, estimate: Estimate) -> Covariance:
        """Mean square error of the carried parameters, as an estimate with covariance states it."""
        assert estimate.covariance is not None
        away = self.x - estimate.x
        return estimate.covariance + np.outer(away, away)

    def _note(self, verdict: Verdict, estimate: Estimate, agreement: Agreement | None) -> None:
        """Note what the checkpoint and the participant's file get after a rest.

        As after an identification, the file gets an estimate that its check contradicts, with this outcome, so that the
        next session does not start from it; and none of a wearer who does not relax.
        """
        self._checked_before = self._checked
        if verdict is Verdict.BEGINS_AGAIN:
            self._checked = None
        elif verdict in FOR_FILE and not is_restless(estimate):
            predicted = self._prediction.of(estimate)
            if predicted is not None and estimate.covariance is not None:
                outcome = self._rule.final(Outcome.TIME_IS_UP, estimate, predicted, agreement)
                outcome = Outcome.DISAGREES if verdict is Verdict.DISAGREES else outcome
                self._checked = CheckedArm(
                    **KeptArm.of(estimate.x, estimate.covariance).model_dump(),
                    motion_s=estimate.t,
                    outcome=outcome.value,
                    predicted_left_over_Nm=predicted.tolist(),
                    held_out_error_Nm=self._held_out.rms.tolist(),
                    held_out_s=self._held_out.window_s,
                )
        found = self._estimate()
        if found.covariance is not None:
            self.kept = self._kept((found.x, found.covariance), self._motion_s)

    def _kept(self, belief: Belief, motion_s: float) -> KeptRests:
        return KeptRests(
            start=KeptArm.of(self._start.x, self._start.covariance),
            estimate=KeptArm.of(*belief),
            motion_s=motion_s,
            rests=self.rests,
            left_out=self._left_out,
            is_contradicted=self._is_contradicted,
            checked=self._checked,
        )

    def _leave_out_last(self) -> None:
        """Estimate again without the samples of the last rest."""
        before = self._used[:-1]
        self._left_out += 1
        self._begin()
        for samples in before:
            self._take(samples)

    def _forget(self, samples: Sequence[Sample]) -> None:
        """Begin again with the samples of this rest, as after the cuffs were fastened anew.

        The cuffs or the machine may have changed. The carried arm stays, and no longer states its old bound.
        """
        layout, kept = ParameterLayout.of(self._model.assembly), kept_part(ParameterLayout.of(self._model.assembly))
        mean, covariance = self._belief
        self._belief = carried_over(layout, (mean[kept], covariance[kept, kept]), self._table, 0.0)
        away = self.x - self._belief[0]
        self.covariance = self._belief[1] + np.outer(away, away)
        self._start, self._before_s = BodyTable(self.x, self.covariance), 0.0
        self._begin()
        self._take(samples)


def rest_motion(assembly: Assembly, rests: int, dt: float, seconds: float = REST_MOTION_S) -> Harmonics:
    """Return the motion after `rests` motions: `seconds` of the machine's excitation, from another phase each time."""
    return planned_excitation(shifted(assembly.description.excitation, rests * SHIFT), seconds, dt)


def check_postures(samples: Sequence[Sample]) -> np.ndarray:
    """Return the postures of a motion, evenly spaced in time [rad]."""
    at = np.linspace(0, len(samples) - 1, CHECK_POSTURES + 2)[1:-1].round().astype(int)
    return np.array([samples[k].q for k in at])


def shifted(excitation: Excitation, share: float) -> Excitation:
    """Return the same periodic motion, begun after a share of its period [-]."""
    angle = 2.0 * np.pi * share * np.arange(1, len(excitation.sine_deg) + 1)[:, None]
    sine, cosine = np.array(excitation.sine_deg), np.array(excitation.cosine_deg)
    return excitation.model_copy(
        update={
            "sine_deg": (np.cos(angle) * sine - np.sin(angle) * cosine).tolist(),
            "cosine_deg": (np.sin(angle) * sine + np.cos(angle) * cosine).tolist(),
        }
    )


def move_in_rest(
    pilot: Pilot, controller: ArmController, path: Trajectory, muscles: MuscleSource | None = None
) -> list[Sample]:
    """Take the relaxed arm from its support, move it along the path, and return the samples, with the way to its start.

    The arm is carried afterwards.

    Raises:
        RigError: The envelope stopped the run.
    """
    dt, posture = pilot.rig.period_s, pilot.q.copy()
    pilot.begin(REST_LEARNING)
    fade(pilot, controller, "gravity_level", 0.0, posture)
    fade(pilot, controller, "drive", REST_LEARNING.drive.goal(is_known=True), posture)
    listener = MeansListener(controller.assembly.n, dt, muscles)
    way = motion.joined([REST_LEARNING.approach(pilot.q, path.q[0], dt), path])
    pilot.run(controller, way, "Learning the arm in a rest", listener)
    return listener.samples
