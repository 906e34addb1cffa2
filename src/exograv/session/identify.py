"""The relaxed arm is moved, and learned while it moves; what is learned drives the next tick."""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from itertools import chain
from types import MappingProxyType

import numpy as np
from jaxtyping import Float

from exograv import motion
from exograv.dynamics import parameters
from exograv.dynamics.machine import CalibratedMachine
from exograv.identification import methods
from exograv.identification.anthropometric import Anthropometric
from exograv.identification.arm_model import ArmModel
from exograv.identification.arm_setting import arm_setting
from exograv.identification.average import Average, average
from exograv.identification.discrepancy import Discrepancy
from exograv.identification.equilibrium import equilibrium
from exograv.identification.full import full
from exograv.identification.gradient import Gradient
from exograv.identification.interface import Estimate, Method, Outcome, Sample
from exograv.identification.left_over import LeftOverPrediction, StopRule, is_restless
from exograv.identification.prior import prior
from exograv.identification.recursive import Recursive
from exograv.identification.sample_filter import SampleFilter
from exograv.identification.setting import Setting
from exograv.model.assembly import Assembly
from exograv.model.rig_settings import Excitation
from exograv.motion import Trajectory

from .arm_controller import ArmController
from .names import MethodName, TorqueSourceName
from .pilot import Moment, Pilot
from .resting_poses import rest_first
from .worn import Worn

PUBLISH_S = 0.2  # new parameters reach the controller at 5 Hz
NOTE_S = 1.0  # and are noted, judged and drawn once a second
EASE_S = 2.0  # a periodic motion starts and ends with speed, an arm does not
TRAVEL = 0.6  # rad/s to the motion's first posture
V_MOTION = 1.3  # rad/s: no joint of a designed motion is faster
SKELETON_TICKS = 50


@dataclass
class Identification:
    """What an identification leaves behind."""

    method: Method
    prior: parameters.Parameters
    """What the method believed before anything moved."""
    prior_covariance: Float[np.ndarray, "parameter parameter"]
    estimates: list[Estimate] = field(default_factory=list)
    """One a second."""
    predicted: list[np.ndarray | None] = field(default_factory=list)
    """Left over that each estimate expects of itself (joint,) [N·m]; None where the method states none."""
    stop_s: float | None = None
    """When the stop rule would have ended the motion [s]."""
    outcome: Outcome = Outcome.RUNNING
    why: str = ""
    """The figures behind the outcome; empty where the method states none."""
    restless_s: float | None = None
    """When the wearer was first seen not to relax [s of motion]."""

    @property
    def last(self) -> Estimate:
        """The final one."""
        return self.estimates[-1]


Belief = tuple[Float[np.ndarray, " parameter"], Float[np.ndarray, "parameter parameter"]]
"""Mean and covariance of everything that is learned, in the order of `dynamics.parameters`."""


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
) -> Method:
    """An identification method for this arm in this machine, on a `model` of the two if there is one already.

    It starts from the table's person, or from a `belief` about this one; methods that state no uncertainty have no use
    for that.
    """
    believed = prior(assembly, machine) if belief is None else belief
    if name == "anthropometric":
        return Anthropometric(table_guess(assembly, machine), believed[1])
    if name == "gradient":
        return Gradient(assembly, machine, table_guess(assembly, machine))
    if name in OF_JUST:
        return OF_JUST[name](assembly, machine)
    return methods.built(name, setting_of(model or ArmModel(assembly, machine), believed))


def setting_of(model: ArmModel, belief: Belief) -> Setting:
    """What the methods that serve any model start from; `model` becomes the method's own."""
    return arm_setting(model, *belief, Discrepancy.of_machine(model.machine.residual_sd))


def table_guess(assembly: Assembly, machine: CalibratedMachine) -> parameters.Parameters:
    """The table's arm in the calibrated machine: what is known before the arm has moved."""
    friction = machine.friction
    return parameters.table_parameters(
        assembly.arm, machine.rotor_inertia, np.asarray(friction.coulomb), np.asarray(friction.viscous)
    )


def identification_motion(
    assembly: Assembly, seconds: float, dt: float, excitation: Excitation | None = None
) -> Trajectory:
    """The machine's excitation, or another, from rest to rest in `seconds`."""
    excitation = excitation or assembly.description.excitation
    path = motion.fourier(
        np.deg2rad(excitation.centre_deg),
        np.deg2rad(excitation.sine_deg),
        np.deg2rad(excitation.cosine_deg),
        excitation.period_s,
        seconds - EASE_S / 2,
        dt,
    )
    return motion.eased_out(motion.eased_in(path, EASE_S), EASE_S)


class Identifier:
    """Listens to the motion, feeds the method, publishes to the controller, judges once a second."""

    def __init__(
        self,
        pilot: Pilot,
        controller: ArmController,
        machine: CalibratedMachine,
        name: MethodName,
        torque_source: TorqueSourceName,
        note: Callable[[float, Estimate, np.ndarray | None, Outcome], None],
        belief: Belief | None = None,
    ):
        self._pilot, self._controller, self._note = pilot, controller, note
        self._torque_source, self.machine = torque_source, machine
        assembly = controller.assembly
        mean, covariance = prior(assembly, machine) if belief is None else belief
        self.followers: list[Callable[[Sample], None]] = []
        """Who else listens to the samples, each before the method takes it."""
        self.model = ArmModel(assembly, machine)
        """Of this arm in this machine; others take another of it by `again`."""
        method = build_method(name, assembly, machine, self.model.again(), belief)
        # A batch solve takes seconds: it is asked when the motion is over.
        self._is_offline = getattr(method, "offline", False)
        self.result = Identification(method, method.estimate().x, covariance)
        self._left_over = LeftOverPrediction(self.model, mean)
        self._rule = StopRule(assembly.description.places)
        self._filter = SampleFilter(assembly.n, pilot.rig.period_s)
        self._ticks = 0
        self._published = self._noted = 0.0

    def __call__(self, moment: Moment) -> None:
        """One tick."""
        tau = moment.tau_measured if self._torque_source == "current" else moment.tau_commanded
        sample = self._filter.update(moment.state.q, tau, moment.reference.q)
        self._ticks += 1
        if self._pilot.recording is not None and self._ticks % SKELETON_TICKS == 0:
            record_skeleton(self._pilot, self._controller, moment)
        if not self._filter.settled:
            return
        for follower in self.followers:
            follower(sample)
        self.result.method.update(sample)
        if self._is_offline or sample.t - self._published < PUBLISH_S - 1e-9:
            return
        self._published = sample.t
        estimate = self.result.method.estimate()
        self._controller.publish(estimate.x, moment.q)
        if sample.t - self._noted > NOTE_S - 1e-9:
            self._noted = sample.t
            self._judge(estimate, moment.state.t)

    def finish(self, moment_t: float) -> Identification:
        """Take everything into account once more and close the books."""
        method = self.result.method
        if isinstance(method, Recursive):
            method.relinearise()
        self._judge(method.estimate(), moment_t)
        result = self.result
        if result.stop_s is None:
            result.outcome = _final_outcome(result)
        return result

    def _judge(self, estimate: Estimate, t: float) -> None:
        result = self.result
        predicted = None if estimate.covariance is None else self._left_over.rms(estimate.covariance)
        result.estimates.append(estimate)
        result.predicted.append(predicted)
        if predicted is not None and result.stop_s is None:
            verdict = self._rule.judge(estimate, predicted)
            result.why = self._rule.why(predicted, self._controller.assembly.description.joints)
            if verdict is not Outcome.RUNNING:
                result.stop_s, result.outcome = estimate.t, verdict
        if result.restless_s is None and is_restless(estimate):
            result.restless_s = estimate.t
            self._tell(t, estimate)
        self._note(t, estimate, predicted, result.outcome)

    def _tell(self, t: float, estimate: Estimate) -> None:
        """The wearer does not relax: the operator hears it while something can still be done."""
        if self._pilot.recording is not None:
            self._pilot.recording.write("/event", t, {"kind": "not relaxed", "text": restless_text(estimate)})


def restless_text(estimate: Estimate) -> str:
    """What to tell about a wearer who does not relax."""
    return (
        f"The person does not relax: muscles push about {estimate.noise_scale:.1f} times as hard as usual, and "
        f"{estimate.rejected_share:.0%} of the samples fit no relaxed arm. "
        "Ask the person to let go; the motion goes on."
    )


def _final_outcome(result: Identification) -> Outcome:
    if isinstance(result.method, Anthropometric | Average):
        return Outcome.TABLE_ONLY
    if is_restless(result.last):
        return Outcome.NOT_RELAXED
    return Outcome.NO_INTERVAL if result.last.covariance is None else Outcome.TIME_IS_UP


def identify_arm(
    pilot: Pilot,
    controller: ArmController,
    identifier: Identifier,
    seconds: float,
    parts: Iterator[Trajectory] | None = None,
) -> Identification:
    """Drive the relaxed arm through the motion for `seconds` and learn it.

    `parts` of `session.motions` take the place of the machine's own motion, each asked for when the last one is over.

    Raises:
        RigError: The envelope stopped the run.
    """
    dt, assembly = pilot.rig.period_s, controller.assembly
    parts = parts or iter([identification_motion(assembly, seconds, dt)])
    path = next(parts)
    found = identifier.result
    pilot.worn = worn = pilot.worn or Worn(pilot.envelope, assembly, identifier.machine, found.prior)
    worn.expect(found.prior, found.prior_covariance, V_MOTION)
    controller.mode.drive = 1.0
    rest_first(pilot, controller, identifier.result.method)
    approach = [motion.go_to(pilot.q, path.q[0], TRAVEL, dt), motion.hold(path.q[0], 0.5, dt)]
    pilot.begin("move")
    pilot.run(controller, motion.joined(approach), "Moving to the start")
    pilot.begin("identify")
    for part in chain([path], parts):
        pilot.run(controller, part, f"Identifying the arm by '{identifier.result.method.name}'", identifier)
    result = identifier.finish(pilot.rig.read().t)
    controller.publish(result.last.x, pilot.q)
    worn.know(result.last.x)
    return result


def record_skeleton(pilot: Pilot, controller: ArmController, moment: Moment) -> None:
    """Where exoskeleton and arm are, for the report's pictures."""
    if pilot.recording is not None:
        exo, arm = controller.skeleton(moment.q)
        pilot.recording.write("/skeleton", moment.state.t, {"exo": exo, "arm": arm})
