"""Identification of the relaxed arm during motion. Each new estimate drives the next tick."""

from collections.abc import Callable, Iterator
from itertools import chain

import numpy as np

from exograv import motion
from exograv.dynamics.machine import CalibratedMachine
from exograv.identification.core.interface import Estimate, Outcome, Sample
from exograv.loop.arm_controller import ArmController
from exograv.loop.person_limits_manager import PersonLimitsManager
from exograv.loop.phases import IDENTIFICATION, ON_THE_WAY
from exograv.loop.pilot import Pilot
from exograv.loop.tick_sample import TickSample
from exograv.model.assembly import Assembly
from exograv.model.rig_settings import Excitation
from exograv.motion import Harmonics, Trajectory

from .check_motion import PlannedCheck, check_tour, excitation_s, unused_postures
from .estimator_session import Belief, EstimatorSession, Identification, restless_text
from .method_names import MethodName, TorqueSourceName
from .resting_poses import rest_first
from .verdict_text import carried_text

EASE_S = 2.0  # a periodic motion starts and ends with speed, an arm starts and ends at rest
V_MOTION = 1.3  # rad/s: no joint of a designed motion is faster
SEEN_EVERY_S = 0.05  # at less than 1.3 rad/s, between postures that differ by less than 4°
SKELETON_TICKS = 50


def identification_motion(
    assembly: Assembly, seconds: float, dt: float, excitation: Excitation | None = None
) -> Trajectory:
    """Excitation of the machine, or another, from rest to rest in `seconds`; it ends with the `planned_check`."""
    path, check = excitation_motion(assembly, excitation_s(seconds), dt, excitation), planned_check(assembly, seconds)
    return path if check is None else motion.joined([path, check_tour(path.q[-1], check.postures, dt)])


def planned_check(assembly: Assembly, seconds: float) -> PlannedCheck | None:
    """Check at the end of a motion of `seconds`, at postures that the machine's own excitation leaves out.

    None if the motion is too short for a check.
    """
    before = excitation_s(seconds)
    if before == seconds:
        return None
    seen = excitation_motion(assembly, before, SEEN_EVERY_S).q
    return PlannedCheck(before, unused_postures(assembly.description, seen))


def excitation_motion(
    assembly: Assembly, seconds: float, dt: float, excitation: Excitation | None = None
) -> Trajectory:
    """Excitation of the machine, or another, from rest to rest in `seconds`, without a check."""
    return planned_excitation(excitation or assembly.description.excitation, seconds, dt).table()


def planned_excitation(excitation: Excitation, seconds: float, dt: float) -> Harmonics:
    """Return an excitation from rest to rest in `seconds`, computed tick by tick."""
    return Harmonics(
        np.deg2rad(excitation.centre_deg),
        np.deg2rad(excitation.sine_deg),
        np.deg2rad(excitation.cosine_deg),
        excitation.period_s,
        seconds,
        EASE_S,
        dt,
    )


class Identifier:
    """Listener of a pilot's motion: learns, publishes to the controller, and notes an estimate once a second."""

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
        self._learner = EstimatorSession(controller.assembly, machine, name, pilot.rig.period_s, belief)
        self.result, self.model = self._learner.result, self._learner.model
        self._ticks = 0

    @property
    def followers(self) -> list[Callable[[Sample], None]]:
        """Observers of the samples, called before the method takes each sample."""
        return self._learner.followers

    def expect(self, check: PlannedCheck | None) -> None:
        """Take the samples from the beginning of `check` on as a test; without one nothing is tested."""
        self._learner.check = check

    def __call__(self, moment: TickSample) -> None:
        """Learn from one tick."""
        tau = moment.tau_measured if self._torque_source == "current" else moment.tau_commanded
        self._ticks += 1
        if self._pilot.recording is not None and self._ticks % SKELETON_TICKS == 0:
            record_skeleton(self._pilot, self._controller, moment)
        x = self._learner.take(moment.state.q, tau, moment.reference.q)
        if x is None:
            return
        self._controller.publish(x, moment.q)
        if self._learner.is_to_note:
            self._judge(self._learner.estimate(), moment.state.t)

    def finish(self, moment_t: float) -> Identification:
        """Judge the final estimate, and return the result."""
        self._judge(self._learner.last(), moment_t)
        return self._learner.close()

    def _judge(self, estimate: Estimate, t: float) -> None:
        relaxed_so_far = self.result.restless_s is None
        predicted = self._learner.judge(estimate)
        if relaxed_so_far and self.result.restless_s is not None and self._pilot.recording is not None:
            # The operator gets the message while the wearer can still relax.
            self._pilot.recording.write("/event", t, {"kind": "not relaxed", "text": restless_text(estimate)})
        self._note(t, estimate, predicted, self.result.outcome)


def identify_arm(
    pilot: Pilot,
    controller: ArmController,
    identifier: Identifier,
    seconds: float,
    parts: Iterator[Trajectory] | None = None,
) -> Identification:
    """Drive the relaxed arm through the motion for `seconds`, and learn it.

    `parts` of `motions` replace the machine's own motion. Each part is requested when the last one is over.

    Raises:
        RigError: The envelope stopped the run.
    """
    dt, assembly = pilot.rig.period_s, controller.assembly
    parts = parts or iter([identification_motion(assembly, seconds, dt)])
    path = next(parts)
    identifier.expect(planned_check(assembly, seconds))
    found = identifier.result
    pilot.worn = worn = pilot.worn or PersonLimitsManager(pilot.envelope, assembly, identifier.machine, found.prior)
    worn.expect(found.prior, found.prior_covariance, V_MOTION)
    controller.mode.drive = IDENTIFICATION.drive.goal(is_known=False)
    rest_first(pilot, controller, identifier.result.method)
    pilot.begin(ON_THE_WAY)
    pilot.run(controller, IDENTIFICATION.approach(pilot.q, path.q[0], dt), "Moving to the start")
    pilot.begin(IDENTIFICATION)
    for part in chain([path], parts):
        pilot.run(controller, part, f"Identifying the arm by '{identifier.result.method.name}'", identifier)
    result = identifier.finish(pilot.rig.t)
    carried, told = result.decided, ("implausible arm", IMPLAUSIBLE)
    if controller.publish(carried.x, pilot.q):
        worn.know(carried.x)
        told = "carried in part", carried_text(carried, assembly.description.joints, result.last.t)
    if pilot.recording is not None and told[1]:
        pilot.recording.write("/event", pilot.rig.t, {"kind": told[0], "text": told[1]})
    return result


IMPLAUSIBLE = (
    "The identified arm is refused: its weight is implausible for the stated height and weight, or it fits the cuffs "
    "in no posture. Check both, and the calibration; then repeat the identification."
)


def record_skeleton(pilot: Pilot, controller: ArmController, moment: TickSample) -> None:
    """Record the points of exoskeleton and arm for the report's pictures."""
    if pilot.recording is not None:
        exo, arm = controller.skeleton(moment.q)
        pilot.recording.write("/skeleton", moment.state.t, {"exo": exo, "arm": arm})
