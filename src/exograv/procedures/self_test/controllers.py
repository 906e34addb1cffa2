"""Controllers of the machine during the self-test."""

import numpy as np
from jaxtyping import Float

from exograv.control.exo_tick import ExoTick
from exograv.signals import Reference

Joints = Float[np.ndarray, " joint"]


class CarryController:
    """Controller that compensates only the machine's weight and damps it. A wrong calibration shows as drift."""

    closure_slope, clearance = 0.0, 1.0

    def __init__(self, exo: ExoTick, joints: int):
        self._exo, self._still = exo, np.zeros(joints)

    @property
    def tau_feedforward(self) -> Joints:
        """Torque of the model [N·m]."""
        return self._exo.tau_feedforward

    def step(self, q: Joints, v: Joints, reference: Reference) -> Joints:
        """Return the torque of weight and damping [N·m]; the reference is not followed."""
        return self._exo.step(q, v, Reference(q, self._still, self._still))


class RunawayController:
    """Faulty controller that a guard must catch: far too much torque, alternating, and at the end NaN."""

    closure_slope, clearance = 0.0, 1.0

    def __init__(self, tau: Joints, ticks: int, size: float):
        """Start with the present torque.

        Args:
            tau: Present torque of the machine [N·m].
            ticks: Ticks with a torque that is too large, before NaN.
            size: Size of the wrong torque [N·m].
        """
        self.tau_feedforward, self._ticks, self._size, self._k = tau, ticks, size, 0

    def step(self, q: Joints, v: Joints, reference: Reference) -> Joints:
        """Return a torque that is far too large, or NaN [N·m]. The guard must catch both."""
        self._k += 1
        if self._k > self._ticks:
            return np.full_like(q, np.nan)
        return self.tau_feedforward + self._size * (-1.0) ** self._k
