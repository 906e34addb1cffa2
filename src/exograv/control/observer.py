"""Observer of position and velocity from a quantised encoder; little lag, for PD control and friction direction."""

import casadi as ca
import numpy as np
from jaxtyping import Float

from exograv import kernel

Joints = Float[np.ndarray, " joint"]


class Observer:
    """Second-order tracking observer, critically damped, one for all joints."""

    def __init__(self, joints: int, dt: float, bandwidth_Hz: float = 30.0):
        self._kernel = kernel.compile(observer_function(joints, dt, bandwidth_Hz), carry={"q": "q_next", "v": "v_next"})
        self.is_started = False
        """True after the first reading."""
        self.native = self._kernel.native
        """One update for a caller in C, after the first reading; None if there is no native code."""
        self._measured = self._kernel.inputs["q_measured"]
        self.q: Joints = self._kernel.inputs["q"]
        """Estimated position [rad]."""
        self.v: Joints = self._kernel.inputs["v"]
        """Estimated velocity [rad/s]."""

    def update(self, q_measured: Joints) -> None:
        """Update `q` and `v` with one encoder reading [rad]."""
        if not self.is_started:
            self.q[:] = q_measured
            self.is_started = True
            return
        self._measured[:] = q_measured
        self._kernel.evaluate()

    @property
    def measured(self) -> Joints:
        """Memory of the encoder reading [rad], for a caller of `native`."""
        return self._measured


def observer_function(joints: int, dt: float, bandwidth_Hz: float) -> ca.Function:
    """CasADi function from reading and estimates (joint,) [rad, rad/s] to the next estimates."""
    q_measured, q, v = (ca.SX.sym(name, joints) for name in ("q_measured", "q", "v"))
    omega = 2 * np.pi * bandwidth_Hz
    # Both poles of the discrete error dynamics are at exp(−ω dt).
    pole = np.exp(-omega * dt)
    position_gain, velocity_gain = 1 - pole**2, (1 - pole) ** 2 / dt
    predicted = q + v * dt
    error = q_measured - predicted
    results = [predicted + position_gain * error, v + velocity_gain * error]
    return ca.Function("observer", [q_measured, q, v], results, ["q_measured", "q", "v"], ["q_next", "v_next"])
