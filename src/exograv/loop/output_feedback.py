"""Control's half of a step: an observer estimates position and velocity, and a controller decides a torque for them."""

from collections.abc import Callable
from typing import Protocol, runtime_checkable

import numpy as np

from exograv.control.observer import Observer
from exograv.safety.guard import COMMAND_LIFE_S, ControlRequest
from exograv.signals import Joints, JointState, Reference

Guide = Callable[[Joints, Joints], Reference]
"""Reference by observed position [rad] and velocity [rad/s]; called in every step."""


@runtime_checkable
class Controller(Protocol):
    """Decides a torque; `ExoTick`, or an arm's tick with its parameters."""

    @property
    def tau_feedforward(self) -> Joints:
        """What the model expects [N·m]."""
        ...

    @property
    def closure_slope(self) -> float:
        """How far the loops are from closed [N·m]."""
        ...

    @property
    def clearance(self) -> float:
        """How far the arm is from a singular posture, 1 far, 0 at it [-]."""
        ...

    def step(self, q: Joints, v: Joints, reference: Reference) -> Joints:
        """Desired torque [N·m]."""
        ...


class NoTorque:
    """`Controller` of a machine whose motors are off."""

    closure_slope, clearance = 0.0, 1.0
    """No loop and no posture is relied on."""

    def __init__(self, joints: int):
        self.tau_feedforward = np.zeros(joints)
        """Nothing is expected [N·m]."""

    def step(self, q: Joints, v: Joints, reference: Reference) -> Joints:
        """Zero torque (joint,) [N·m]."""
        return self.tau_feedforward


class OutputFeedback:
    """`AnsweringControl` in this process."""

    def __init__(self, joints: int, period_s: float, controller: Controller | None = None):
        """Nothing has been observed yet.

        Args:
            joints: Number of joints.
            period_s: Time between two steps [s].
            controller: Decides the torque; zero torque without one.
        """
        self._joints, self._period_s = joints, period_s
        self.controller: Controller = NoTorque(joints) if controller is None else controller
        """May be replaced between two steps, like the two below."""
        self.reference = Reference(*np.zeros((3, joints)))
        """What the controller follows; in a step with a guide, the guide's reference."""
        self.guide: Guide | None = None
        """Makes the reference in each step; absent where it is set between steps."""
        self.forget()

    def forget(self) -> None:
        """Begin with a new observer: the last measurement is too old."""
        observer = self._observer = Observer(self._joints, self._period_s)
        self.q: Joints = observer.q
        """Observed position; overwritten in each step [rad]."""
        self.v: Joints = observer.v
        """Observed velocity; overwritten in each step [rad/s]."""

    @property
    def closure_slope(self) -> float:
        """Slope of the controller's loops [N·m]."""
        return self.controller.closure_slope

    def answer(self, believed: JointState | None, now: float) -> ControlRequest | None:
        """Answer a measurement; None without one."""
        if believed is None:
            return None
        return ControlRequest(believed.sequence, now + COMMAND_LIFE_S, self.step(believed.q))

    def step(self, q_measured: Joints) -> Joints:
        """Desired torque [N·m] for a measured position [rad]; the controller overwrites it in the next step."""
        self._observer.update(q_measured)
        if self.guide is not None:
            self.reference = self.guide(self.q, self.v)
        return self.controller.step(self.q, self.v, self.reference)
