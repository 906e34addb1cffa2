"""A known weight in the hand or at the forearm: the same way without and with it."""

from collections.abc import Callable, Sequence

import numpy as np
from jaxtyping import Float

from exograv.dynamics import parameters
from exograv.errors import RigError
from exograv.identification.core.arm_model import ArmModel
from exograv.identification.core.interface import Estimate, Sample
from exograv.identification.core.prior import prior
from exograv.loop.arm_controller import ArmController
from exograv.loop.mode_ramp import fade
from exograv.loop.person_limits_manager import HEAVIEST_KG
from exograv.loop.phases import WEIGHING
from exograv.loop.pilot import Pilot
from exograv.model.arm import WeightPlace, held_weight
from exograv.model.support import sample_postures
from exograv.motion import Trajectory

from .motion_samples import MotionListener
from .weighing_path import WeighingPath, informative_path
from .weight_estimator import Weighing, WeightEstimator, WeightPasses

TORQUE_SHARE = 0.8  # of a motor's torque that arm, weight and friction may ask at rest; the rest is for moving
SPEED = 0.7  # rad/s: a little faster than a relaxed arm is moved by hand
PASS_S = 60.0
CANDIDATES = 64  # postures of the task workspace, every pair of which is a way


def weigh(
    pilot: Pilot,
    controller: ArmController,
    model: ArmModel,
    arm: Estimate,
    hang: Callable[[bool], None],
    place: WeightPlace = "hand",
) -> Weighing:
    """Move the arm to and fro without and with the weight, find it, and carry it from then on.

    Once roughly known the weight is carried already, so that both passes lead through the same postures.

    Args:
        pilot: On the worn machine.
        controller: The arm's; it drives afterwards.
        model: Of this arm in the machine as calibrated.
        arm: As identified, without the weights that the controller carries already.
        hang: Puts the weight into its place, or takes it away: the wearer's part.
        place: In the hand or at the forearm.

    Raises:
        RigError: The machine cannot carry `HEAVIEST_KG` there, or the envelope stopped the run.
    """
    dt, text = pilot.rig.period_s, f"Weighing at the {place}"
    x = arm.x.copy()
    for where, mass in controller.weights.items():
        x[parameters.ParameterLayout.of(model.assembly).phi] += held_weight(model.assembly.arm, mass, at=where)
    way = path_for_weight(model, x, place)
    estimator = WeightEstimator(model, x, _covariance(arm, model), place)
    fade(pilot, controller, "drive", WEIGHING.drive.goal(is_known=True), pilot.q.copy())
    fade(pilot, controller, "gravity_level", 0.0, pilot.q.copy())
    if pilot.worn is not None:  # only now: a floating arm may be moved faster than one that is weighed
        pilot.worn.weigh(x, place, SPEED)
    hang(False)
    empty = _heard(pilot, controller, way, way.trajectory(PASS_S, dt), f"{text}: without")
    hang(True)
    once = way.trajectory(0.0, dt)
    first = _heard(pilot, controller, way, once, f"{text}: a first look")
    rough = estimator.weigh(WeightPasses(empty[: len(first)], first))
    controller.carry(place, float(np.clip(rough.mass, 0.0, HEAVIEST_KG)), pilot.q)
    loaded = _heard(pilot, controller, way, way.trajectory(PASS_S, dt), f"{text}: with")
    found = estimator.weigh(WeightPasses(empty, loaded), rough.mass)
    controller.carry(place, max(found.mass, 0.0), pilot.q)
    if pilot.worn is not None:
        weights = [held_weight(model.assembly.arm, mass, at=where) for where, mass in controller.weights.items()]
        pilot.worn.know(arm.x, np.sum(weights, axis=0) if weights else None)
    return found


def path_for_weight(model: ArmModel, x: parameters.Parameters, place: WeightPlace) -> WeighingPath:
    """The way that tells most of a weight there, among postures in which the motors hold `HEAVIEST_KG`.

    Raises:
        RigError: There are not two of them.
    """
    held = held_weight(model.assembly.arm, HEAVIEST_KG, at=place)
    loaded = x.copy()
    loaded[parameters.ParameterLayout.of(model.assembly).phi] += held
    description = model.assembly.description
    postures = sample_postures(description, CANDIDATES)[1:]
    asked = np.array([np.abs(model.at_rest(q, loaded)[0]) for q in postures]) + model.machine.friction.coulomb
    limit = TORQUE_SHARE * description.per_actuator("torque_max_Nm")
    share = (asked / limit).max(axis=1)
    if np.count_nonzero(share <= 1.0) < 2:
        least = asked[int(share.argmin())]
        joint = int((least / limit).argmax())
        raise RigError(
            f"{description.name} cannot carry {HEAVIEST_KG:g} kg at the {place}: {description.joints[joint]} would "
            f"need {least[joint]:.1f} N·m where it needs least; allowed: {limit[joint]:.1f} N·m, {TORQUE_SHARE:.0%} "
            "of its motor's. Use a stronger machine."
        )
    return informative_path(model, x, held, SPEED, postures[share <= 1.0])


def _heard(pilot: Pilot, controller: ArmController, way: WeighingPath, path: Trajectory, text: str) -> Sequence[Sample]:
    """Go to the way's beginning, wait until all is calm, and listen to the way."""
    dt = pilot.rig.period_s
    pilot.run(controller, WEIGHING.approach(pilot.q, way.low, dt), text)
    listener = MotionListener(len(way.low), dt)
    pilot.run(controller, path, text, listener)
    return listener.samples


def _covariance(arm: Estimate, model: ArmModel) -> Float[np.ndarray, "parameter parameter"]:
    """Of the arm; where a method states none, what was believed before it moved."""
    return prior(model.assembly, model.machine)[1] if arm.covariance is None else arm.covariance
