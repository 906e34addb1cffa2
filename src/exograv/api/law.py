"""A user's control law on top of gravity compensation, behind the guard."""

from collections.abc import Callable

import numpy as np
from jaxtyping import Float

from exograv.errors import ConfigError
from exograv.loop.arm_controller import ArmController
from exograv.signals import Reference

Joints = Float[np.ndarray, " joint"]
Law = Callable[[Joints, Joints, float], Joints]
"""Torque that is added to the compensation (joint,) [N·m], by position [rad], velocity [rad/s] and time [s]."""


class CompensationWithLaw:
    """`Controller` that adds the torque of a law to the compensation of an arm; the guard limits the sum."""

    def __init__(self, arm: ArmController, law: Law, period_s: float):
        self._arm, self._law, self._period_s, self._ticks = arm, law, period_s, 0

    @property
    def tau_feedforward(self) -> Joints:
        """Torque that the model of machine and arm expects [N·m]."""
        return self._arm.tau_feedforward

    @property
    def closure_slope(self) -> float:
        """Remaining slope of the cuff energy [N·m]; close to 0 where the loops are closed."""
        return self._arm.closure_slope

    @property
    def clearance(self) -> float:
        """Distance of the arm from a singular posture, 1 far, 0 at it [-]."""
        return self._arm.clearance

    def step(self, q: Joints, v: Joints, reference: Reference) -> Joints:
        """Return the desired torque (joint,) [N·m].

        Raises:
            ConfigError: The law returned an array of another shape.
        """
        tau = self._arm.step(q, v, reference)
        added = np.asarray(self._law(q.copy(), v.copy(), self._ticks * self._period_s), dtype=float)
        if added.shape != tau.shape:
            raise ConfigError(
                f"The law returned shape {added.shape}; it must return {tau.shape}, one torque per joint."
            )
        self._ticks += 1
        return tau + added
