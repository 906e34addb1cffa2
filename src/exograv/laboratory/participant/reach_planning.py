"""Planning of a reach to the screen: posture with the finger at a place, and path to it."""

import numpy as np
from jaxtyping import Float

from exograv import motion
from exograv.motion import Trajectory
from exograv.rig.twin.behaviour.internal_model import ArmInverseDynamics
from exograv.rig.twin.world.surroundings import Surroundings

from .habits import Habits

PerFreedom = Float[np.ndarray, " arm"]
Place = Float[np.ndarray, " 3"]

PLANNED_HZ = 25.0
"""Sampling rate of a planned path. Muscles follow up to 4 Hz."""

POSTURE_WEIGHT = 0.03
"""Weight of an unusual posture [1/rad] against an error of the finger [1/m]: 10° for 2 mm."""


class ReachPaths:
    """Paths of one person in front of one screen."""

    def __init__(
        self, own: ArmInverseDynamics, surroundings: Surroundings, usual: PerFreedom, habits: Habits, period_s: float
    ):
        """Set up the planner. `usual` is the posture [rad] in which the person prefers to touch the screen."""
        self._own, self._surroundings, self._usual = own, surroundings, usual
        self._habits, self._dt = habits, period_s

    def to_screen(self, rest: PerFreedom, q_screen: PerFreedom) -> Trajectory:
        """Path from rest to a posture at the screen [rad].

        The finger approaches from the front, not along the screen.
        """
        seconds = self._habits.reach_s
        ticks, n = round(seconds / self._dt), round(seconds * PLANNED_HZ)
        shares = motion.minimum_jerk(np.zeros(1), np.ones(1), seconds, seconds / n).q[:, 0]
        tips = self._own.fingertip(rest), self._own.fingertip(q_screen)
        before = tips[1] + self._habits.approach_m * self._surroundings.screen_axes[:, 2]
        q, rows = rest, [rest]
        for s in shares.tolist():
            place = (1 - s) ** 2 * tips[0] + 2 * s * (1 - s) * before + s**2 * tips[1]
            q = self.reached(place, rest + s * (q_screen - rest), q, 2)
            rows.append(q)
        from scipy.interpolate import CubicSpline  # The import takes 0.1 s.

        spline = CubicSpline(np.arange(n + 1) * seconds / n, np.array(rows), bc_type="clamped")
        t = np.arange(1, ticks + 1) * self._dt
        return Trajectory(spline(t), spline(t, 1), spline(t, 2), self._dt)

    def posture_at(self, place: Float[np.ndarray, " 2"], depth_m: float) -> PerFreedom:
        """Modify the usual posture so that the finger is at `place` on the screen [m], `depth_m` behind the glass."""
        surroundings = self._surroundings
        wanted = surroundings.screen_centre + surroundings.screen_axes @ np.append(place, -depth_m)
        return self.reached(wanted, self._usual, self._usual, 8)

    def reached(self, wanted: Place, usual: PerFreedom, q: PerFreedom, steps: int) -> PerFreedom:
        """Compute the posture nearest to a usual one with the finger at `wanted` [m], in iterations from `q`."""
        for _ in range(steps):
            tip, J = self._own.fingertip_slope(q)
            H = J.T @ J + POSTURE_WEIGHT**2 * np.eye(len(q))
            q = q + np.linalg.solve(H, J.T @ (wanted - tip) + POSTURE_WEIGHT**2 * (usual - q))
        return q
