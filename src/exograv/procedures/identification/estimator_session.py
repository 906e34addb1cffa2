"""Estimator session: learns an arm from a stream of samples, in a session's process or in a live run's worker."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from types import MappingProxyType

import numpy as np
from jaxtyping import Float

from exograv.dynamics import parameters
from exograv.dynamics.machine import CalibratedMachine
from exograv.errors import IdentificationError
from exograv.identification import methods
from exograv.identification.baselines.anthropometric import Anthropometric
from exograv.identification.baselines.average import Average, average
from exograv.identification.baselines.equilibrium import equilibrium
from exograv.identification.baselines.full import full
from exograv.identification.baselines.gradient import Gradient
from exograv.identification.core.arm_model import ArmModel
from exograv.identification.core.arm_setting import arm_setting
from exograv.identification.core.carried_arm import BodyTable, CarriedArm, carried_arm, widened_by_check
from exograv.identification.core.discrepancy import Discrepancy
from exograv.identification.core.interface import Agreement, Checkable, Estimate, Method, Outcome, Sample
from exograv.identification.core.left_over import LeftOverPrediction, StopRule, is_restless
from exograv.identification.core.muscle_signals import MuscleSignals
from exograv.identification.core.prior import prior
from exograv.identification.core.sample_filter import SampleFilter
from exograv.identification.core.setting import Setting
from exograv.identification.recursive.recursive import Recursive
from exograv.model.arm import is_plausible
from exograv.model.assembly import Assembly

from .check_motion import PlannedCheck
from .method_names import MethodName
from .verdict_text import carried_text, check_text, slip_text

PUBLISH_S = 0.2  # new parameters reach the controller at 5 Hz
NOTE_S = 1.0  # estimates are recorded, judged and drawn once a second

Joints = Float[np.ndarray, " joint"]


@dataclass
class Identification:
    """Result of an identification."""

    method: Method
    prior: parameters.Parameters
    """Mean of the prior: the parameters that the method starts from."""
    prior_covariance: Float[np.ndarray, "parameter parameter"]
    estimates: list[Estimate] = field(default_factory=list)
    """Estimates, one per second."""
    predicted: list[np.ndarray | None] = field(default_factory=list)
    """Left over that each estimate predicts for itself (joint,) [N·m]; None if the method states no uncertainty."""
    stop_s: float | None = None
    """Time at which the stop rule would have ended the motion [s]; None if it would not have ended it."""
    outcome: Outcome = Outcome.RUNNING
    why: str = ""
    """Figures behind the outcome; empty if the method states none."""
    agreement: Agreement | None = None
    """Check of the estimate at postures that it had not used; None without one."""
    restless_s: float | None = None
    """Time of motion at which the wearer was first seen not to relax [s]."""
    carried: CarriedArm | None = None
    """Arm that the machine carries while it floats; None before the end."""

    @property
    def last(self) -> Estimate:
        """Estimate after the last sample."""
        return self.estimates[-1]

    @property
    def decided(self) -> CarriedArm:
        """Arm that the machine carries while it floats."""
        if self.carried is None:
            raise IdentificationError("The identification has not ended, so no arm is chosen to float. Close it first.")
        return self.carried

    @property
    def floated(self) -> Estimate:
        """Estimate with the parameters that the machine carries."""
        return self.decided.of(self.last)


Belief = tuple[Float[np.ndarray, " parameter"], Float[np.ndarray, "parameter parameter"]]
"""Mean and covariance of all parameters, in the order of `dynamics.parameters`."""


OF_JUST: Mapping[str, Callable[[Assembly, CalibratedMachine], Method]] = MappingProxyType(
    {"average": average, "full": full, "equilibrium": equilibrium}
)
"""Just et al.'s methods, which need an arm in cuffs."""


def build_method(
    name: MethodName,
    assembly: Assembly,
    machine: CalibratedMachine,
    model: ArmModel | None = None,
    belief: Belief | None = None,
    muscles: MuscleSignals | None = None,
) -> Method:
    """Return an identification method for this arm in this machine, on `model` if it exists already.

    The method starts from the table's person, or from a `belief` about this person. Methods without uncertainty ignore
    the belief, and only the method 'recursive' uses signals of the `muscles`.
    """
    believed = prior(assembly, machine) if belief is None else belief
    if name == "anthropometric":
        return Anthropometric(table_guess(assembly, machine), believed[1])
    if name == "gradient":
        return Gradient(assembly, machine, table_guess(assembly, machine))
    if name in OF_JUST:
        return OF_JUST[name](assembly, machine)
    return methods.built(name, replace(setting_of(model or ArmModel(assembly, machine), believed), muscles=muscles))


def setting_of(model: ArmModel, belief: Belief) -> Setting:
    """Return the setting from which the model-independent methods start; `model` becomes the method's own."""
    return arm_setting(model, *belief, Discrepancy.of_machine(model.machine.residual_sd))


def arm_to_carry(
    estimate: Estimate, assembly: Assembly, machine: CalibratedMachine, prediction: LeftOverPrediction | None = None
) -> CarriedArm:
    """Decide how much of an estimate a machine carries when it floats the arm; the only place of that decision.

    An implausible arm is passed on as it is, because the controller refuses it.
    """
    if not is_plausible(assembly.arm, estimate.x):
        estimate = replace(estimate, covariance=None)
    believed = prior(assembly, machine)
    table = BodyTable(table_guess(assembly, machine), believed[1])
    prediction = prediction or LeftOverPrediction(ArmModel(assembly, machine), believed[0])
    return carried_arm(estimate, table, prediction, parameters.ParameterLayout.of(assembly).bodies)


def table_guess(assembly: Assembly, machine: CalibratedMachine) -> parameters.Parameters:
    """Parameters of the table's arm in the calibrated machine, known before the arm has moved."""
    friction = machine.friction
    return parameters.table_parameters(
        assembly.arm, machine.rotor_inertia, np.asarray(friction.coulomb), np.asarray(friction.viscous)
    )


class EstimatorSession:
    """Session that feeds samples to a method, publishes estimates at 5 Hz and judges them once a second."""

    def __init__(
        self,
        assembly: Assembly,
        machine: CalibratedMachine,
        name: MethodName,
        period_s: float,
        belief: Belief | None = None,
        muscles: MuscleSignals | None = None,
    ):
        """Prepare the session before any motion.

        Args:
            assembly: Machine and arm.
            machine: Calibration of the machine.
            name: Name of the method.
            period_s: Time between two ticks [s].
            belief: Belief about this person from another day; the table's person if None.
            muscles: Signals of the muscles that each tick brings; None without.
        """
        self._assembly, self._machine = assembly, machine
        mean, covariance = prior(assembly, machine) if belief is None else belief
        self.followers: list[Callable[[Sample], None]] = []
        """Observers of the samples, called before the method takes each sample."""
        self.model = ArmModel(assembly, machine)
        """Model of this arm in this machine. Other users take a copy by `again`."""
        method = build_method(name, assembly, machine, self.model.again(), belief, muscles)
        # A batch solve takes seconds, so it runs only after the motion.
        self._is_offline = getattr(method, "offline", False)
        self.result = Identification(method, method.estimate().x, covariance)
        self._left_over = LeftOverPrediction(self.model, mean)
        self.before = mean, np.sqrt(np.diag(covariance)), self._left_over.rms(covariance)
        """Belief before any motion: parameters, their standard deviations, and the left over that both predict."""
        self._rule = StopRule(assembly.description.places, assembly.description.joints)
        self.check: PlannedCheck | None = None
        """Check at the end of the motion, set before the motion; None if there is none."""
        self._is_held_out = False
        self._filter = SampleFilter(assembly.n, period_s)
        self._published = self._noted = 0.0

    def take(
        self,
        q: Joints,
        tau: Joints,
        q_asked: Joints | None,
        v: Joints | None = None,
        muscles: Float[np.ndarray, " channel"] | None = None,
    ) -> parameters.Parameters | None:
        """Take one tick.

        Args:
            q: Measured position [rad].
            tau: Measured torque [N·m].
            q_asked: Requested position [rad]; None if it is not known.
            v: Measured velocity [rad/s]; differentiated from `q` if None.
            muscles: Signals of the muscles as in `Sample.muscles`; None without.

        Returns:
            Parameters to publish; None in ticks in which none are due.
        """
        sample = self._filter.update(q, tau, q_asked, v, muscles)
        if not self._filter.settled:
            return None
        for follower in self.followers:
            follower(sample)
        if self.check is not None and not self._is_held_out and sample.t >= self.check.from_s:
            self._is_held_out = True
            if isinstance(self.result.method, Checkable):
                self.result.method.hold_out(self.check.postures)
        self.result.method.update(sample)
        if self._is_offline or sample.t - self._published < PUBLISH_S - 1e-9:
            return None
        self._published = sample.t
        method = self.result.method
        return method.parameters() if isinstance(method, Recursive) else method.estimate().x

    def estimate(self) -> Estimate:
        """Return the estimate of the parameters that were published last, for `judge`."""
        return self.result.method.estimate()

    def interrupt(self) -> None:
        """Restart the filter after an interruption of the motion."""
        self._filter.restart()

    @property
    def is_to_note(self) -> bool:
        """True if the estimate of the parameters just published is due to be judged, once a second."""
        if self._published - self._noted <= NOTE_S - 1e-9:
            return False
        self._noted = self._published
        return True

    def judge(self, estimate: Estimate) -> np.ndarray | None:
        """Apply the stop rule, and check if the wearer relaxes.

        Return the left over that the estimate predicts (joint,) [N·m]; None if it states no uncertainty.
        """
        result = self.result
        predicted = self._left_over.of(estimate)
        result.estimates.append(estimate)
        result.predicted.append(predicted)
        if predicted is not None and result.stop_s is None:
            verdict = self._rule.judge(estimate, predicted)
            result.why = self._rule.why(predicted)
            if verdict is not Outcome.RUNNING:
                result.stop_s, result.outcome = estimate.t, verdict
        if result.restless_s is None and is_restless(estimate):
            result.restless_s = estimate.t
        return predicted

    def last(self) -> Estimate:
        """Return the final estimate; a recursive method relinearises first."""
        method = self.result.method
        if isinstance(method, Recursive):
            method.relinearise()
        return method.estimate()

    def close(self) -> Identification:
        """Return the result after the last estimate was judged."""
        result = self.result
        if result.stop_s is None:
            result.outcome = _final_outcome(result)
        if isinstance(result.method, Checkable):
            result.agreement = result.method.agreement()
        last, predicted = result.last, result.predicted[-1]
        if predicted is not None:
            result.outcome = self._rule.final(result.outcome, last, predicted, result.agreement)
            result.estimates[-1] = widened_by_check(last, self._left_over, result.agreement)
            result.predicted[-1] = self._left_over.of(result.last)
        result.carried = arm_to_carry(result.last, self._assembly, self._machine, self._left_over)
        result.why = self._why(result, result.carried)
        return result

    def _why(self, result: Identification, carried: CarriedArm) -> str:
        """Figures behind the outcome and the decision to float; empty if the method states none."""
        description, last, predicted = self._assembly.description, result.last, result.predicted[-1]
        if predicted is None:
            return ""
        texts = (
            self._rule.why(predicted),
            check_text(result.outcome, result.agreement, description.joints),
            slip_text(last, self._left_over.by_slip(last), description),
            carried_text(carried, description.joints, last.t),
        )
        return " ".join(text for text in texts if text)


def restless_text(estimate: Estimate) -> str:
    """Return the message about a wearer who does not relax."""
    return (
        f"The person does not relax: muscles push about {estimate.noise_scale:.1f} times as hard as usual, and "
        f"{estimate.rejected_share:.0%} of the samples fit no relaxed arm. "
        "Ask the person to relax. The motion continues."
    )


def _final_outcome(result: Identification) -> Outcome:
    if isinstance(result.method, Anthropometric | Average):
        return Outcome.TABLE_ONLY
    if is_restless(result.last):
        return Outcome.NOT_RELAXED
    return Outcome.NO_INTERVAL if result.last.covariance is None else Outcome.TIME_IS_UP
