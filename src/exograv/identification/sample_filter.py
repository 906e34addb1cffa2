"""Positions and torques through the same filter: velocity and acceleration without differentiating noise."""

import numpy as np
from jaxtyping import Float
from scipy.linalg import expm

from .interface import Sample

Joints = Float[np.ndarray, " joint"]


class SampleFilter:
    """Third-order Bessel filter whose states are the filtered position, velocity and acceleration.

    Bessel, because its group delay is flat: a slow motion passes as if only delayed, and so do the torques, so that
    the model may be evaluated at the filtered motion. Corner at 1.75/`delay_s` rad/s.
    """

    def __init__(self, joints: int, dt: float, delay_s: float = 0.04):
        w = 1.0 / delay_s
        # 15 w³ / (s³ + 6 w s² + 15 w² s + 15 w³)
        continuous = np.zeros((4, 4))
        continuous[:3] = [[0, 1, 0, 0], [0, 0, 1, 0], [-15 * w**3, -15 * w**2, -6 * w, 15 * w**3]]
        self._step: Float[np.ndarray, "3 4"] = np.ascontiguousarray(expm(continuous * dt)[:3])
        self._rows = np.zeros((4, 2 * joints))  # value and two derivatives, then the input that is held over the tick
        self._state, self._next = self._rows[:3], np.zeros((3, 2 * joints))
        self._q_in, self._tau_in = self._rows[3, :joints], self._rows[3, joints:]
        self._dt = dt
        self._t = 0.0
        self._warm_up = round(6 * delay_s / dt)
        self.settled = False
        """Whether the start's transient has died out."""
        n = joints
        self.sample = Sample(0.0, self._state[0, :n], self._state[1, :n], self._state[2, :n], self._state[0, n:])
        """The newest filtered sample; its arrays are overwritten by `update`."""

    def update(self, q: Joints, tau: Joints) -> Sample:
        """Take position [rad] and torque [N·m] of one tick."""
        self._q_in[:] = q
        self._tau_in[:] = tau
        if self._warm_up > 0 and not self._state[0].any():
            self._state[0] = self._rows[3]
        np.dot(self._step, self._rows, out=self._next)
        self._state[:] = self._next
        if self._warm_up > 0:
            self._warm_up -= 1
        else:
            self.settled = True
            self._t += self._dt
        self.sample.t = self._t
        return self.sample
