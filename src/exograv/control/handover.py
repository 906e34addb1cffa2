"""Ramp of new parameters into the loop, so that the wearer feels no push."""

import math

import numpy as np

from exograv.dynamics.parameters import Parameters

TORQUE_RATE_MAX_Nm_per_s = 5.0  # docs/explanation/safety.md: parameter update
RAMP_MIN_S = 0.2  # assumed: one publication period of an identifier


class Handover:
    """Active parameters, ramped to the newest ones within the allowed torque rate."""

    def __init__(self, x: Parameters, dt: float):
        self._dt = dt
        self._start = x.copy()
        self._goal = x.copy()
        self._ticks = 0
        self._tick = 0
        self.x = x.copy()
        """Active parameters. Every mixture of two physical arms is physical."""

    def publish(self, x: Parameters, torque_change_Nm: float) -> None:
        """Start a ramp to `x`; its largest torque change in the present posture is `torque_change_Nm`."""
        self._start[:] = self.x
        self._goal[:] = x
        seconds = max(RAMP_MIN_S, abs(torque_change_Nm) / TORQUE_RATE_MAX_Nm_per_s)
        self._ticks, self._tick = math.ceil(seconds / self._dt), 0

    def step(self) -> Parameters:
        """Advance the ramp by one tick and return the parameters."""
        if self._tick < self._ticks:
            self._tick += 1
            np.subtract(self._goal, self._start, out=self.x)
            self.x *= self._tick / self._ticks
            self.x += self._start
        return self.x
