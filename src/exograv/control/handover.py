"""Ramp of new parameters into the loop, so that the wearer feels no push."""

import math
from array import array

import numpy as np

from exograv.dynamics.parameters import Parameters

TORQUE_RATE_MAX_Nm_per_s = 5.0  # docs/explanation/safety.md: parameter update
RAMP_MIN_S = 0.2  # assumed: one publication period of an identifier


class Handover:
    """Active parameters, ramped to the newest ones within the allowed torque rate."""

    def __init__(self, x: Parameters, dt: float):
        self._dt = dt
        self.start, self.goal = x.copy(), x.copy()
        """Ends of the ramp."""
        self.counts = array("q", [0, 0])
        """Number of ticks that have passed on the ramp, and its length. Native code advances the same ramp."""
        self.x = x.copy()
        """Active parameters. Every mixture of two physical arms is physical."""

    def force(self, x: Parameters) -> None:
        """Put `x` in force at once, without a ramp."""
        self.start[:] = self.goal[:] = self.x[:] = x
        self.counts[0] = self.counts[1] = 0

    def publish(self, x: Parameters, torque_change_Nm: float) -> None:
        """Start a ramp to `x`; its largest torque change in the present posture is `torque_change_Nm`."""
        self.start[:] = self.x
        self.goal[:] = x
        seconds = max(RAMP_MIN_S, abs(torque_change_Nm) / TORQUE_RATE_MAX_Nm_per_s)
        self.counts[0], self.counts[1] = 0, math.ceil(seconds / self._dt)

    def step(self) -> Parameters:
        """Advance the ramp by one tick and return the parameters."""
        passed, ticks = self.counts
        if passed < ticks:
            self.counts[0] = passed = passed + 1
            np.subtract(self.goal, self.start, out=self.x)
            self.x *= passed / ticks
            self.x += self.start
        return self.x
