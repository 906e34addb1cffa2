"""Weighing of a known weight in the hand or at the forearm, on the same path without and with the weight."""

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
from exograv.loop.phases import WEIGHING
from exograv.loop.pilot import Pilot
from exograv.model.arm import WeightPlace, held_weight
from exograv.model.support import sample_postures
from exograv.motion import Trajectory
from exograv.options import HEAVIEST_KG

from .motion_samples import MotionListener
from .weighing_path import WeighingPath, informative_path
from .weight_estimator import Weighing, WeightEstimator, WeightPasses

TORQUE_SHARE = 0.8  # share of a motor's torque for arm, weight and friction at rest; the rest is for motion
SPEED = 0.7  # rad/s: a little faster than a relaxed arm is moved by hand
PASS_S = 60.0
CANDIDATES = 64  # postures of the task workspace; every pair is a possible path


def weigh(
    pilot: Pilot,
    controller: ArmController,
    model: ArmModel,
    arm: Estimate,
    hang: Callable[[bool], None],
    place: WeightPlace = "hand",
) -> Weighing:
    """Move the arm to and fro without and with the weight, estimate the weight, and carry it from then on.

    The machine carries the weight from the first rough estimate on, so that both passes go through the same postures.

    Args:
        pilot: Pilot of the worn machine.
        controller: Controller of the arm; it drives the arm afterwards, too.
        model: Model of this arm in the machine as calibrated.
        arm: Arm as identified, without the weights that the controller carries already.
        hang: Function that puts the weight into its place, or removes it; the wearer's part.
        place: Place of the weight, in the hand or at the forearm.

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
    if pilot.worn is not None:  # only now, because a floating arm may move faster than one that is weighed
        pilot.worn.weigh(x, place, SPEED)
    hang(False)
    empty = _heard(pilot, controller, way, way.trajectory(PASS_S, dt), f"{text}: without")
    hang(True)
    once = way.trajectory(0.0, dt)
    first = _heard(pilot, controller, way, once, f"{text}: first estimate")
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
    """Return the most informative path for a weight there, among postures in which the motors hold `HEAVIEST_KG`.

    Raises:
        RigError: There are less than two such postures.
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
            f"need at least {least[joint]:.1f} N·m; allowed: {limit[joint]:.1f} N·m, {TORQUE_SHARE:.0%} "
            "of its motor's. Use a stronger machine."
        )
    return informative_path(model, x, held, SPEED, postures[share <= 1.0])


def _heard(pilot: Pilot, controller: ArmController, way: WeighingPath, path: Trajectory, text: str) -> Sequence[Sample]:
    """Move to the start of the path, wait until all is calm, and return the samples of the path."""
    dt = pilot.rig.period_s
    pilot.run(controller, WEIGHING.approach(pilot.q, way.low, dt), text)
    listener = MotionListener(len(way.low), dt)
    pilot.run(controller, path, text, listener)
    return listener.samples


def _covariance(arm: Estimate, model: ArmModel) -> Float[np.ndarray, "parameter parameter"]:
    """Covariance of the arm; the prior covariance if the method states none."""
    return prior(model.assembly, model.machine)[1] if arm.covariance is None else arm.covariance
