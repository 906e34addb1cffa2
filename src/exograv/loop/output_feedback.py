"""Control's half of a step: an observer estimates position and velocity, a controller computes the torque."""

from collections.abc import Callable
from typing import Protocol, runtime_checkable

import numpy as np

from exograv.control.observer import Observer
from exograv.safety.guard import COMMAND_LIFE_S, ControlRequest
from exograv.signals import Joints, JointState, Reference

Guide = Callable[[Joints, Joints], Reference]
"""Function that returns the reference for the observed position [rad] and velocity [rad/s]. It is called in every step.
"""


@runtime_checkable
class Controller(Protocol):
    """Interface of a controller, which computes a torque: `ExoTick`, or an arm's tick with its parameters."""

    @property
    def tau_feedforward(self) -> Joints:
        """Joint torque that the model expects [N·m]."""
        ...

    @property
    def closure_slope(self) -> float:
        """Remaining slope of the cuff energy [N·m]; close to 0 where the loops are closed."""
        ...

    @property
    def clearance(self) -> float:
        """Distance of the arm from a singular posture [-]: 1 far, 0 at the singularity."""
        ...

    def step(self, q: Joints, v: Joints, reference: Reference) -> Joints:
        """Desired joint torque [N·m]."""
        ...


class NoTorque:
    """`Controller` of a machine with its motors off."""

    closure_slope, clearance = 0.0, 1.0
    """Values of a controller that uses no loop and no posture."""

    def __init__(self, joints: int):
        self.tau_feedforward = np.zeros(joints)
        """Expected torque [N·m]: always zero."""

    def step(self, q: Joints, v: Joints, reference: Reference) -> Joints:
        """Zero torque (joint,) [N·m]."""
        return self.tau_feedforward


class OutputFeedback:
    """`AnsweringControl` in this process."""

    def __init__(self, joints: int, period_s: float, controller: Controller | None = None):
        """Begin without any observation.

        Args:
            joints: Number of joints.
            period_s: Time between two steps [s].
            controller: Computes the torque; without a controller the torque is zero.
        """
        self._joints, self._period_s = joints, period_s
        self.controller: Controller = NoTorque(joints) if controller is None else controller
        """Controller in force. It may be replaced between two steps, as may `reference` and `guide`."""
        self.reference = Reference(*np.zeros((3, joints)))
        """Reference of the controller. In a step with a guide, the guide sets it."""
        self.guide: Guide | None = None
        """Function that computes the reference in each step. If absent, the caller sets the reference between steps."""
        self.forget()

    def forget(self) -> None:
        """Begin with a new observer, because the last measurement is too old."""
        observer = self.observer = Observer(self._joints, self._period_s)
        self.q: Joints = observer.q
        """Observed position; overwritten in each step [rad]."""
        self.v: Joints = observer.v
        """Observed velocity; overwritten in each step [rad/s]."""

    @property
    def closure_slope(self) -> float:
        """Remaining gradient of the controller's closure [N·m]; 0 if its loops are closed."""
        return self.controller.closure_slope

    def answer(self, believed: JointState | None, now: float) -> ControlRequest | None:
        """Answer a measurement. Return None without a measurement."""
        if believed is None:
            return None
        return ControlRequest(believed.sequence, now + COMMAND_LIFE_S, self.step(believed.q))

    def step(self, q_measured: Joints) -> Joints:
        """Desired torque [N·m] for a measured position [rad]. The controller overwrites the array in the next step."""
        self.observer.update(q_measured)
        if self.guide is not None:
            self.reference = self.guide(self.q, self.v)
        return self.controller.step(self.q, self.v, self.reference)
