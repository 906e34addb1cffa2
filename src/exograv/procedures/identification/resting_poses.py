"""Resting poses: the worn machine holds the relaxed arm still in several postures, and measurements are averaged."""

import numpy as np
from jaxtyping import Float

from exograv import motion
from exograv.errors import ConfigError
from exograv.identification.core.interface import Rest, RestingMethod
from exograv.loop.arm_controller import ArmController
from exograv.loop.mode_ramp import fade
from exograv.loop.phases import RESTING, TRAVEL_RAD_S
from exograv.loop.pilot import Pilot
from exograv.loop.tick_sample import TickSample
from exograv.rig.interface import CuffSensing, Rig

APPROACH_RAD = 0.09  # 5°: the hysteresis of friction and tissue reverses within it (assumed)
APPROACH_S = 1.0
AVERAGE_S = 2.0  # from each side. Half of a wearer's slow torque lasts longer.

Joints = Float[np.ndarray, " joint"]


class _Mean:
    """Listener that collects samples while the arm is still."""

    def __init__(self, rig: CuffSensing):
        self._rig = rig
        self.rows: list[tuple[Joints, Joints, Float[np.ndarray, "cuff 6"]]] = []

    def __call__(self, moment: TickSample) -> None:
        self.rows.append((moment.state.q, moment.tau_measured.copy(), self._rig.cuff_wrenches()))


def take_rests(pilot: Pilot, controller: ArmController, postures: Float[np.ndarray, "rest joint"]) -> tuple[Rest, ...]:
    """Let the arm rest in each of `postures` [rad], approached from both sides, and average.

    Call it before the first sample of a method that needs rests (`identification.interface.RestingMethod`): pass its
    `postures`, hand the result to its `take_rests`, and add its `rest_s` to the seconds of motion where times are
    compared. Approaches from both sides cancel friction in the motors' torque and hysteresis in the wearer's joints.

    Args:
        pilot: Pilot of the worn machine.
        controller: Controller of the arm with the present parameters; it drives the arm afterwards, too.
        postures: Postures of the machine's joints.

    Raises:
        ConfigError: The machine has no force/torque sensors at its cuffs.
        RigError: The envelope stopped the run.
    """
    rig = sensing(pilot.rig)
    rests = []
    for number, posture in enumerate(postures):
        begin, mean = _now(pilot), _Mean(rig)
        pilot.begin(RESTING)
        fade(pilot, controller, "drive", RESTING.drive.goal(is_known=False), pilot.q.copy())
        text = f"Resting, posture {number + 1} of {len(postures)}"
        for side in (-1.0, 1.0):
            _rest_from(pilot, controller, posture, posture + side * APPROACH_RAD, text, mean)
        q, tau, wrenches = (np.mean(column, axis=0) for column in zip(*mean.rows, strict=True))
        rests.append(Rest(q, tau, wrenches, _now(pilot) - begin))
    return tuple(rests)


def rest_first(pilot: Pilot, controller: ArmController, method: object) -> None:
    """Measure the rests that a method needs, and publish its estimate to the controller; other methods need none.

    Raises:
        ConfigError: The machine has no force/torque sensors at its cuffs.
        RigError: The envelope stopped the run.
    """
    if isinstance(method, RestingMethod):
        method.take_rests(take_rests(pilot, controller, method.postures))
        controller.publish(method.estimate().x, pilot.q)


def sensing(rig: Rig) -> CuffSensing:
    """Return the machine as one with cuff sensors.

    Raises:
        ConfigError: The machine has no force/torque sensors at its cuffs.
    """
    if not isinstance(rig, CuffSensing):
        raise ConfigError(
            "This machine has no force/torque sensors at its cuffs, and the methods 'full' and 'equilibrium' use "
            "only these. Choose another --method: 'recursive' needs only motor currents."
        )
    return rig


def _now(pilot: Pilot) -> float:
    """Time on the rig's clock [s]."""
    return pilot.rig.t


def _rest_from(
    pilot: Pilot, controller: ArmController, posture: Joints, beside: Joints, text: str, listener: _Mean
) -> None:
    """Reach a posture [rad] from beside it, come to rest, and listen."""
    dt = pilot.rig.period_s
    way = [
        motion.go_to(pilot.q, beside, TRAVEL_RAD_S, dt),
        motion.minimum_jerk(beside, posture, APPROACH_S, dt),
        motion.hold(posture, RESTING.settle_s, dt),
    ]
    pilot.run(controller, motion.joined(way), text)
    pilot.run(controller, motion.hold(posture, AVERAGE_S, dt), text, listener)
