"""An arm along a path that waits for it: time on the path slows where the person holds against it, and gives up.

    rate → speed · min(1, (1 − strain) / (1 − FREE)),   strain = largest error over the pull's reach

`rate` is how fast time passes on the path. At a strain of 1 the path stands; from `HELD` on the pull fades. Whoever
comes back is led on, whoever stays away is let go.
"""

import numpy as np
from jaxtyping import Float

from exograv.motion import Trajectory
from exograv.signals import Reference

from .grip import DROP_S, FREE, GRIP_S, GripOutcome, next_grip, pace
from .pull import REACH_RAD, PullStrength

Joints = Float[np.ndarray, " joint"]

FASTER_PER_S, SLOWER_PER_S = 0.5, 10.0
"""How quickly the path's rate may change."""


class PathGuide:
    """Turns where the arm is into what the control law is to follow; one call a tick."""

    def __init__(self, path: Trajectory, strength: PullStrength, speed: float, grip: float = 0.0):
        """Nothing leads yet: `lead` does.

        Args:
            path: As fast as it may be driven.
            strength: Of the pull.
            speed: Share of the path's own speed, up to 1.
            grip: Share of the pull that is in force already.
        """
        self.path, self.strength, self.speed = path, strength, speed
        self.state = GripOutcome.FREE
        self.grip = grip
        """Share of the pull that is in force."""
        self.rate = 0.0
        """Seconds on the path per second."""
        self.tau = np.zeros(path.q.shape[1])
        """Pull at the last tick [N·m]."""
        self.target = path.q[0].copy()
        """Where the arm should have been then [rad]."""
        self.place = 0.0
        """Ticks of the path behind the arm."""
        self.waited_s = 0.0
        """For how long it went at less than half of its speed, because somebody held against it."""

    def lead(self) -> None:
        """Take the arm along, from where it is on the path; the pull comes by a ramp."""
        self.state = GripOutcome.LED

    def let_go(self) -> None:
        """Somebody asks for it: the pull goes in `DROP_S`."""
        if self.state in (GripOutcome.LED, GripOutcome.ARRIVED):
            self.state = GripOutcome.RELEASED

    @property
    def has_let_go(self) -> bool:
        """Whether nothing pulls any more, because the arm was let go."""
        return self.state in (GripOutcome.OVERRULED, GripOutcome.RELEASED) and self.grip == 0.0

    @property
    def has_arrived(self) -> bool:
        """Whether the arm is held at the path's end."""
        return self.state is GripOutcome.ARRIVED

    def __call__(self, q: Joints, v: Joints) -> Reference:
        """What control is to follow with the arm at `q` [rad], moving with `v` [rad/s]."""
        dt = self.path.dt
        before, q_path, v_path, a_path = self.rate, *self._at(self.place)
        self.target = q_path
        strain = float(np.abs(q_path - q).max()) / REACH_RAD
        self.grip, self.state = next_grip(self.grip, self.state, strain, dt)
        faster = 0.0
        if self.state is GripOutcome.LED:
            wanted = self.speed * pace(strain)
            self.rate = float(np.clip(wanted, before - SLOWER_PER_S * dt, before + FASTER_PER_S * dt))
            faster = (self.rate - before) / dt
            self.waited_s += dt if wanted < 0.5 * self.speed else 0.0
            self.place = min(self.place + self.rate, len(self.path) - 1.0)
            if self.place >= len(self.path) - 1.0:
                self.state, self.rate, faster = GripOutcome.ARRIVED, 0.0, 0.0
        # What an arm that is let go gets for the path's motion goes with the pull, without a step.
        a_along = a_path * self.rate**2 + v_path * faster
        moving = Reference(q_path, self.grip * v_path * self.rate, self.grip * a_along)
        self.tau = self.strength.torque(q, v, moving, self.grip)
        return self.strength.reference(q, v, moving, self.tau)

    def _at(self, place: float) -> tuple[Joints, Joints, Joints]:
        """Position, velocity and acceleration of the path between two of its ticks."""
        k = min(int(place), len(self.path) - 2)
        s, path = place - k, self.path
        q, v, a = ((1.0 - s) * table[k] + s * table[k + 1] for table in (path.q, path.v, path.a))
        return q, v, a


class Anchor:
    """Takes hold of a floating arm, wherever it is: the pull comes, and its place goes along with whoever moves on."""

    def __init__(self, q: Joints, strength: PullStrength, dt: float):
        """Nothing holds the arm at `q` [rad] yet."""
        self._strength, self._dt, self._lets_go = strength, dt, False
        self.grip = 0.0
        """Share of the pull that is in force."""
        self.target = q.copy()
        """Where the arm is held [rad]."""

    def let_go(self) -> None:
        """As of `PathGuide`."""
        self._lets_go = True

    def __call__(self, q: Joints, v: Joints) -> Reference:
        """As of `PathGuide`."""
        slack = FREE * REACH_RAD
        self.target = np.clip(self.target, q - slack, q + slack)
        more = -1.0 / DROP_S if self._lets_go else 1.0 / GRIP_S
        self.grip = min(max(self.grip + self._dt * more, 0.0), 1.0)
        still = np.zeros_like(q)
        there = Reference(self.target, still, still)
        return self._strength.reference(q, v, there, self._strength.torque(q, v, there, self.grip))
