"""What flies the machine while it is tested."""

import numpy as np
from jaxtyping import Float

from exograv.control.exo_tick import ExoTick
from exograv.signals import Reference

Joints = Float[np.ndarray, " joint"]


class CarryController:
    """The machine carries itself by its calibration, and is held by nothing else: what is wrong with it drifts."""

    closure_slope, clearance = 0.0, 1.0

    def __init__(self, exo: ExoTick, joints: int):
        self._exo, self._still = exo, np.zeros(joints)

    @property
    def tau_feedforward(self) -> Joints:
        """What the model expects [N·m]."""
        return self._exo.tau_feedforward

    def step(self, q: Joints, v: Joints, reference: Reference) -> Joints:
        """Weight, and damping; the reference is not followed [N·m]."""
        return self._exo.step(q, v, Reference(q, self._still, self._still))


class RunawayController:
    """Asks for what no controller should: far too much, to and fro, and in the end for what is no number."""

    closure_slope, clearance = 0.0, 1.0

    def __init__(self, tau: Joints, ticks: int, size: float):
        """Begin.

        Args:
            tau: What the machine gives already [N·m].
            ticks: How long it only asks for too much.
            size: How much [N·m].
        """
        self.tau_feedforward, self._ticks, self._size, self._k = tau, ticks, size, 0

    def step(self, q: Joints, v: Joints, reference: Reference) -> Joints:
        """A wrong torque [N·m]."""
        self._k += 1
        if self._k > self._ticks:
            return np.full_like(q, np.nan)
        return self.tau_feedforward + self._size * (-1.0) ** self._k
