"""A drive: motor current to joint torque and back."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

Joints = Float[np.ndarray, " joint"]


@dataclass(frozen=True)
class ActuatorGain:
    """Joint torque per motor current: current × torque constant × gear ratio × efficiency, as calibrated.

    The efficiency is a constant factor here; losses that grow with the load belong to `Friction.load_share`.
    """

    gain: Joints
    """[N·m/A]"""

    gain_sd: Joints
    """Standard deviation of the calibrated gain [N·m/A]."""

    def torque(self, current: Float[np.ndarray, "*state joint"]) -> Float[np.ndarray, "*state joint"]:
        """Torque [N·m] that the motor puts on the joint, before friction."""
        return self.gain * current

    def current(self, tau: Float[np.ndarray, "*state joint"]) -> Float[np.ndarray, "*state joint"]:
        """Current [A] for a torque [N·m]."""
        return tau / self.gain
