"""New parameters enter the loop by a ramp: no update may be felt as a push."""

import math

import numpy as np

from exograv.dynamics.parameters import Parameters

TORQUE_RATE_MAX_Nm_per_s = 5.0  # docs/safety.md: parameter update
RAMP_MIN_S = 0.2  # assumed: one publication period of an identifier


class Handover:
    """Holds the parameters in force and moves them to the newest ones no faster than the torque may change."""

    def __init__(self, x: Parameters, dt: float):
        self._dt = dt
        self._start = x.copy()
        self._goal = x.copy()
        self._ticks = 0
        self._tick = 0
        self.x = x.copy()
        """In force now. Between two physical arms every mixture is physical."""

    def publish(self, x: Parameters, torque_change_Nm: float) -> None:
        """Head for `x`, which would change some joint's torque by this much in the present posture."""
        self._start[:] = self.x
        self._goal[:] = x
        seconds = max(RAMP_MIN_S, abs(torque_change_Nm) / TORQUE_RATE_MAX_Nm_per_s)
        self._ticks, self._tick = math.ceil(seconds / self._dt), 0

    def step(self) -> Parameters:
        """Parameters for this tick."""
        if self._tick < self._ticks:
            self._tick += 1
            np.subtract(self._goal, self._start, out=self.x)
            self.x *= self._tick / self._ticks
            self.x += self._start
        return self.x
