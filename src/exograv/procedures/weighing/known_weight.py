"""Weighing of a known weight in the hand or at the forearm, on the same path without and with the weight."""

from collections.abc import Callable, Sequence

import numpy as np
from jaxtyping import Float

from exograv.dynamics import parameters
from exograv.errors import RigError
from exograv.identification.core.arm_model import ArmModel
from exograv.identification.core.interface import Estimate, Sample
from exograv.identification.core.prior import prior
from exograv.loop.moved_machine import MovedMachine, approach
from exograv.loop.phases import WEIGHING
from exograv.model.arm import WeightPlace, held_weight
from exograv.model.support import sample_postures
from exograv.motion import Cycles
from exograv.options import HEAVIEST_KG

from .motion_samples import MotionListener
from .weighing_path import WeighingPath, informative_path
from .weight_estimator import Weighing, WeightEstimator, WeightPasses

TORQUE_SHARE = 0.8  # share of a motor's torque for arm, weight and friction at rest; the rest is for motion
SPEED = 0.7  # rad/s: a little faster than a relaxed arm is moved by hand
PASS_S = 60.0
FADES_S = 3.0  # the machine lets go of a weight as slowly as the torque of its motors may change
CANDIDATES = 64  # postures of the task workspace; every pair is a possible path


def weigh(
    machine: MovedMachine,
    model: ArmModel,
    arm: Estimate,
    hang: Callable[[bool], None],
    place: WeightPlace = "hand",
) -> Weighing:
    """Move the arm to and fro without and with the weight, estimate the weight, and carry it from then on.

    The machine carries the weight from the first rough estimate on, so that both passes go through the same postures.

    Args:
        machine: Machine that carries the arm; it holds the arm afterwards, too.
        model: Model of this arm in the machine as calibrated.
        arm: Arm as identified, without the weights that the machine carries already.
        hang: Function that puts the weight into its place, or removes it; the wearer's part.
        place: Place of the weight, in the hand or at the forearm.

    Raises:
        RigError: The machine cannot carry `HEAVIEST_KG` there, or the envelope stopped the run.
    """
    dt, text = machine.period_s, f"Weighing at the {place}"
    x = _with_others(machine, model, arm, place)
    way = path_for_weight(model, x, place)
    estimator = WeightEstimator(model, x, _covariance(arm, model), place)
    machine.lead()
    machine.expect_weight(x, place, SPEED)  # only now, because a floating arm may move faster than one that is weighed
    hang(False)
    empty = _heard(machine, way, way.cycles(PASS_S, dt), f"{text}: without")
    hang(True)
    first = _heard(machine, way, way.cycles(0.0, dt), f"{text}: first estimate")
    rough = estimator.weigh(WeightPasses(empty[: len(first)], first))
    machine.carry(place, float(np.clip(rough.mass, 0.0, HEAVIEST_KG)))
    loaded = _heard(machine, way, way.cycles(PASS_S, dt), f"{text}: with")
    found = estimator.weigh(WeightPasses(empty, loaded), rough.mass)
    machine.carry(place, max(found.mass, 0.0))
    machine.know(arm.x)
    return found


def put_down(
    machine: MovedMachine, model: ArmModel, arm: Estimate, hang: Callable[[bool], None], place: WeightPlace
) -> None:
    """Have a weight that was weighed removed, and carry it no more. The machine holds the arm meanwhile.

    Raises:
        RigError: The machine was stopped.
    """
    machine.expect_weight(_with_others(machine, model, arm, place), place, SPEED)
    hang(False)
    machine.carry(place, 0.0)
    machine.hold(FADES_S, f"The weight at the {place} is off")
    machine.know(arm.x)


def _with_others(
    machine: MovedMachine, model: ArmModel, arm: Estimate, place: WeightPlace
) -> Float[np.ndarray, " parameter"]:
    """Return the parameters of the arm with the weights that are carried at other places."""
    x, phi = arm.x.copy(), parameters.ParameterLayout.of(model.assembly).phi
    for where, mass in machine.weights.items():
        if where != place:
            x[phi] += held_weight(model.assembly.arm, mass, at=where)
    return x


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


def _heard(machine: MovedMachine, way: WeighingPath, path: Cycles, text: str) -> Sequence[Sample]:
    """Move to the start of the path, wait until all is calm, and return the samples of the path."""
    approach(machine, WEIGHING, way.low, text)
    listener = MotionListener(len(way.low), machine.period_s)
    machine.follow(path, text, listener.take)
    return listener.samples


def _covariance(arm: Estimate, model: ArmModel) -> Float[np.ndarray, "parameter parameter"]:
    """Covariance of the arm; the prior covariance if the method states none."""
    return prior(model.assembly, model.machine)[1] if arm.covariance is None else arm.covariance
