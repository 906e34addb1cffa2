"""Position and velocity from a quantised encoder, with little lag: what the weak PD and the friction direction need."""

import numpy as np
from jaxtyping import Float

Joints = Float[np.ndarray, " joint"]


class Observer:
    """Second-order tracking observer, critically damped, one for all joints."""

    def __init__(self, joints: int, dt: float, bandwidth_Hz: float = 30.0):
        omega = 2 * np.pi * bandwidth_Hz
        # Poles of the discrete error dynamics both at exp(−ω dt).
        pole = np.exp(-omega * dt)
        self._position_gain = 1 - pole**2
        self._velocity_gain = (1 - pole) ** 2 / dt
        self._dt = dt
        self._started = False
        self.q: Joints = np.zeros(joints)
        """Estimated position [rad]."""
        self.v: Joints = np.zeros(joints)
        """Estimated velocity [rad/s]."""

    def update(self, q_measured: Joints) -> None:
        """Take one encoder reading [rad] into `q` and `v`."""
        if not self._started:
            self.q[:] = q_measured
            self._started = True
            return
        self.q += self.v * self._dt
        error = q_measured - self.q
        self.q += self._position_gain * error
        self.v += self._velocity_gain * error
