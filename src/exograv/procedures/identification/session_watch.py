"""Watch over a session of hours: the motion of the identification is repeated in a rest, judged, and learned again."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from exograv.dynamics.parameters import ParameterLayout
from exograv.identification.core.arm_model import ArmModel
from exograv.identification.core.carried_arm import BodyTable, CarriedArm, carried_arm
from exograv.identification.core.interface import Covariance, Estimate, Parameters, Sample
from exograv.identification.core.left_over import LeftOverPrediction
from exograv.identification.core.prior import prior
from exograv.identification.core.sample_filter import SampleFilter
from exograv.identification.core.sample_pace import BATCH_PERIOD_S, Averages
from exograv.identification.drift.slow_change import Kind, SlowJudgement
from exograv.identification.drift.slow_watch import SlowWatch, with_slid_cuffs
from exograv.identification.recursive.recursive import Recursive
from exograv.loop.arm_controller import ArmController
from exograv.loop.mode_ramp import fade
from exograv.loop.person_limits_manager import PersonLimitsManager
from exograv.loop.phases import SESSION_CHECK
from exograv.loop.pilot import Pilot
from exograv.loop.tick_sample import TickSample
from exograv.model.assembly import Assembly
from exograv.model.loops import FIT

from .estimator_session import build_method
from .identify import V_MOTION, excitation_motion
from .muscle_source import MuscleSource
from .warm_start import FROM_FILE_S

CHECK_S = FROM_FILE_S
"""Duration of the repeated motion [s]."""

AGAIN_SHARE = 0.1
"""Share of the prior's standard deviation by which the estimate is widened before it is learned again [-], beside the
changes that were found. Assumed."""


@dataclass(frozen=True)
class LearnedAgain:
    """Result of a second identification in the same session."""

    assembly: Assembly
    """Machine and arm, with the cuffs where the check has found them."""
    estimate: Estimate
    carried: CarriedArm

    def controller(self, before: ArmController, period_s: float) -> ArmController:
        """Return a controller of this arm in the mode of the one before."""
        made = ArmController(self.assembly, before.machine, self.carried.x, period_s)
        made.mode.drive, made.mode.gravity_level = before.mode.drive, before.mode.gravity_level
        made.mode.arm_share = before.mode.arm_share
        return made


class SessionWatch:
    """Watch over one arm from its identification on."""

    def __init__(self, model: ArmModel, x: Parameters, covariance: Covariance, before: Sequence[Sample]):
        """Begin after the identification.

        Args:
            model: Model of this arm in this machine.
            x: Parameters that the machine carries.
            covariance: Covariance of `x`.
            before: Samples of the identification's motion, from its first tick on. Its first seconds are the check's.
        """
        self._model, self._x, self._covariance = model.again(), x, covariance
        self._watch = SlowWatch(model.again(), x, covariance, before)

    def judge(self, samples: Sequence[Sample]) -> SlowJudgement:
        """Compare a repetition of the motion with the motion before."""
        return self._watch.judge(samples)

    def learn_again(self, samples: Sequence[Sample], judgement: SlowJudgement) -> LearnedAgain:
        """Identify the arm again by the samples of a repetition; the present estimate, widened, is the prior.

        The watch then begins anew: its next judgements refer to this motion.
        """
        machine, assembly = self._model.machine, with_slid_cuffs(self._model.assembly, judgement)
        if assembly is not self._model.assembly:
            self._model = ArmModel(assembly, machine)
        belief = self._x, widened(self._model, self._x, self._covariance, judgement)
        method = build_method("recursive", assembly, machine, self._model.again(), belief)
        assert isinstance(method, Recursive)
        for sample in samples:
            method.update(sample)
        method.relinearise()
        estimate = method.estimate()
        before = BodyTable(*belief)  # the arm that is carried now, in place of the body table's
        prediction = LeftOverPrediction(self._model.again(), self._x)
        carried = carried_arm(estimate, before, prediction, ParameterLayout.of(assembly).bodies)
        if carried.covariance is not None:
            self._x, self._covariance = carried.x, carried.covariance
        self._watch = SlowWatch(self._model.again(), self._x, self._covariance, samples)
        return LearnedAgain(assembly, estimate, carried)


def widened(model: ArmModel, x: Parameters, covariance: Covariance, judgement: SlowJudgement) -> Covariance:
    """Return the covariance of an estimate after the changes that a check has found."""
    layout, assembly = ParameterLayout.of(model.assembly), model.assembly
    before = prior(assembly, model.machine)[1]
    more = np.zeros(len(x))
    offset = slice(layout.fit.start, layout.fit.start + 3)
    length = layout.fit.start + FIT.index("upper_arm_lengthening")
    joints, freedoms = list(assembly.description.joints), list(assembly.arm.freedoms)
    for found in (*judgement.changes, *judgement.one_of):
        size, place = abs(found.size) + found.half_width, found.cause.place
        if found.cause.kind is Kind.CUFF and found in judgement.changes:
            size = 0.5 * found.half_width  # its way is in the model, up to an error
        if found.cause.kind in (Kind.CUFF, Kind.SHOULDER):
            # No parameter is the place of a cuff. Shoulder and length move the arm in the machine as a cuff does.
            more[offset] += size**2
            more[length] += size**2
        elif found.cause.kind is Kind.TONE:
            more[layout.spring_offset.start + freedoms.index(place)] += size**2
        elif found.cause.kind in (Kind.FRICTION, Kind.WARM_UP):
            which = slice(None) if found.cause.kind is Kind.WARM_UP else joints.index(place)
            more[layout.coulomb][which] += (size * x[layout.coulomb][which]) ** 2
            more[layout.viscous][which] += (size * x[layout.viscous][which]) ** 2
    return covariance + AGAIN_SHARE**2 * before + np.diag(more)


def repeat_motion(pilot: Pilot, controller: ArmController) -> list[Sample]:
    """Move the relaxed arm through the first seconds of its identification, and return the samples.

    The arm is carried before and afterwards.

    Raises:
        RigError: The envelope stopped the run.
    """
    dt, assembly = pilot.rig.period_s, controller.assembly
    path = excitation_motion(assembly, CHECK_S, dt)
    posture = pilot.q.copy()
    pilot.begin(SESSION_CHECK)
    fade(pilot, controller, "gravity_level", 0.0, posture)
    fade(pilot, controller, "drive", SESSION_CHECK.drive.goal(is_known=True), posture)
    pilot.run(controller, SESSION_CHECK.approach(pilot.q, path.q[0], dt), "Moving to the start of the check")
    listener = MeansListener(assembly.n, dt)
    pilot.run(controller, path, "Comparing the arm with its identification", listener)
    return listener.samples


class MeansListener:
    """Listener for `Pilot.run` that stores averaged samples, with the requested motion as in identification."""

    def __init__(self, joints: int, dt: float, muscles: MuscleSource | None = None):
        self._filter, self._averages, self._muscles = SampleFilter(joints, dt), Averages(BATCH_PERIOD_S), muscles
        self.samples: list[Sample] = []
        """Averaged samples that were stored so far."""

    def __call__(self, moment: TickSample) -> None:
        """Filter the measurement of one tick."""
        self.take(moment.state.q, moment.tau_measured, moment.reference.q)

    def take(self, q: np.ndarray, tau: np.ndarray, q_asked: np.ndarray) -> None:
        """Filter one tick: measured positions [rad] and torques [N·m] (joint,), and requested positions [rad]."""
        signals = None if self._muscles is None else self._muscles.now()
        sample = self._filter.update(q, tau, q_asked, muscles=signals)
        mean = self._averages.take(sample) if self._filter.settled else None
        if mean is not None:
            self.samples.append(mean)


def expect_again(worn: PersonLimitsManager, x: Parameters, covariance: Covariance) -> None:
    """Give the guard the limits for a repetition of the motion with an arm that may have changed."""
    worn.expect(x, covariance, V_MOTION)
