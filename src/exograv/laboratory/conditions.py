"""Support conditions while effort is measured: none, the machine's weight, or the arm's weight too."""

import numpy as np
from jaxtyping import Float

from exograv.loop.arm_controller import ArmController
from exograv.loop.output_feedback import Controller, NoTorque
from exograv.loop.tick_sample import TickSample
from exograv.signals import Reference

from .effort import Performer

HAND_OVER_S = 4.0  # A person can follow 2.8 N·m/s, from 11 N·m, a heavy arm (docs/explanation/safety.md).

Joints = Float[np.ndarray, " joint"]


class ScaledController:
    """`Controller` that gives a share of another controller's torque."""

    def __init__(self, controller: Controller):
        self._controller = controller
        self.share = 1.0
        """Share of the torque [-]."""

    @property
    def tau_feedforward(self) -> Joints:
        """Motor torque as the model expects it [N·m]."""
        return self.share * self._controller.tau_feedforward

    @property
    def closure_slope(self) -> float:
        """Remaining gradient of the closure [N·m]; close to 0 if the loops are closed."""
        return self._controller.closure_slope

    @property
    def clearance(self) -> float:
        """Distance of the arm from a singular posture [-]."""
        return self._controller.clearance

    def step(self, q: Joints, v: Joints, reference: Reference) -> Joints:
        """Return the share of the torque (joint,) [N·m]."""
        return self.share * self._controller.step(q, v, reference)


def leave_the_arm(performer: Performer, controller: ArmController, dt: float) -> Controller:
    """Hand the arm's weight over to the wearer; the machine's own weight stays carried."""
    step = dt / HAND_OVER_S

    def fade(_moment: TickSample) -> None:
        controller.mode.arm_share = max(0.0, controller.mode.arm_share - step)

    performer.wait(controller, HAND_OVER_S, fade)
    controller.mode.arm_share = 0.0
    return controller


def switch_off(performer: Performer, controller: ArmController, dt: float) -> Controller:
    """Fade all torque out; return the controller of a machine whose motors are off."""
    fading, step = ScaledController(controller), dt / HAND_OVER_S

    def fade(_moment: TickSample) -> None:
        fading.share = max(0.0, fading.share - step)

    performer.wait(fading, HAND_OVER_S, fade)
    return NoTorque(len(controller.tau_feedforward))
