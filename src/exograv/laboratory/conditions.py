"""What is done for the wearer of a machine while effort is measured: nothing, the machine's weight, the arm's too."""

import numpy as np
from jaxtyping import Float

from exograv.loop.arm_controller import ArmController
from exograv.loop.output_feedback import Controller, NoTorque
from exograv.loop.pilot import TickSample
from exograv.signals import Reference

from .effort import Performer

HAND_OVER_S = 4.0  # 11 N·m, a heavy arm, at 2.8 N·m/s: a person follows that (docs/safety.md)

Joints = Float[np.ndarray, " joint"]


class Fading:
    """`Controller` that gives a share of another one's torque."""

    def __init__(self, controller: Controller):
        self._controller = controller
        self.share = 1.0
        """[-]"""

    @property
    def tau_feedforward(self) -> Joints:
        """What the model expects the motors to give [N·m]."""
        return self.share * self._controller.tau_feedforward

    @property
    def closure_slope(self) -> float:
        """How far the loops are from closed [N·m]."""
        return self._controller.closure_slope

    @property
    def clearance(self) -> float:
        """How far the arm is from a singular posture [-]."""
        return self._controller.clearance

    def step(self, q: Joints, v: Joints, reference: Reference) -> Joints:
        """The share (joint,) [N·m]."""
        return self.share * self._controller.step(q, v, reference)


def leave_the_arm(performer: Performer, controller: ArmController, dt: float) -> Controller:
    """Let the arm's weight go, the person taking it over; the machine's own weight stays carried."""
    step = dt / HAND_OVER_S

    def fade(_moment: TickSample) -> None:
        controller.mode.arm_share = max(0.0, controller.mode.arm_share - step)

    performer.wait(controller, HAND_OVER_S, fade)
    controller.mode.arm_share = 0.0
    return controller


def switch_off(performer: Performer, controller: ArmController, dt: float) -> Controller:
    """Let everything go; what flies the machine from then on is nothing."""
    fading, step = Fading(controller), dt / HAND_OVER_S

    def fade(_moment: TickSample) -> None:
        fading.share = max(0.0, fading.share - step)

    performer.wait(fading, HAND_OVER_S, fade)
    return NoTorque(len(controller.tau_feedforward))
