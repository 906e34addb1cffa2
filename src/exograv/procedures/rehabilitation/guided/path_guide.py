"""Path guide: an arm is led along a path that slows down and gives way where the person holds against it.

    rate → speed · min(1, (1 − strain) / (1 − FREE)),   strain = largest error over the pull's reach

`rate` is the speed of time on the path. At a strain of 1 the path stops; from `HELD` on the pull fades. A person who
comes back is led on; a person who stays away is released.
"""

import numpy as np
from jaxtyping import Float

from exograv.motion import Passage, Trajectory
from exograv.signals import Reference

from .grip import DROP_S, FREE, GRIP_S, GripOutcome, next_grip, pace
from .pull import REACH_RAD, PullStrength

Joints = Float[np.ndarray, " joint"]

FASTER_PER_S, SLOWER_PER_S = 0.5, 10.0
"""Largest increase and decrease of the path's rate [1/s]."""


class PathGuide:
    """Guide along a path: turns the arm's position into a reference for the control law; call it once per tick."""

    def __init__(self, path: Trajectory | Passage, strength: PullStrength, speed: float, grip: float = 0.0):
        """Prepare the guide; guidance starts with `lead`.

        Args:
            path: Path at its highest allowed speed.
            strength: Strength of the pull.
            speed: Share of the path's own speed, up to 1.
            grip: Share of the pull that acts already.
        """
        self.path, self.strength, self.speed = path, strength, speed
        self.state = GripOutcome.FREE
        self.grip = grip
        """Share of the pull that acts."""
        self.rate = 0.0
        """Rate of time on the path [s/s]."""
        self.target = path.at(0)[0].copy()
        """Target of the arm at the last tick [rad]."""
        self.tau = np.zeros_like(self.target)
        """Pull at the last tick [N·m]."""
        self.place = 0.0
        """Position on the path, in ticks."""
        self.waited_s = 0.0
        """Time with less than half of the wanted speed because the person held against the guidance [s]."""

    def lead(self) -> None:
        """Start to guide the arm from its position on the path. The pull comes by a ramp."""
        self.state = GripOutcome.LED

    def let_go(self) -> None:
        """Release the arm on request: the pull fades in `DROP_S`."""
        if self.state in (GripOutcome.LED, GripOutcome.ARRIVED):
            self.state = GripOutcome.RELEASED

    @property
    def has_let_go(self) -> bool:
        """True if the arm was released and the pull is zero."""
        return self.state in (GripOutcome.OVERRULED, GripOutcome.RELEASED) and self.grip == 0.0

    @property
    def has_arrived(self) -> bool:
        """True if the arm is held at the path's end."""
        return self.state is GripOutcome.ARRIVED

    def __call__(self, q: Joints, v: Joints) -> Reference:
        """Return the reference for the control law with the arm at `q` [rad] and joint velocity `v` [rad/s]."""
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
        # The feed-forward of the path's motion fades with the pull, so that a release makes no torque step.
        a_along = a_path * self.rate**2 + v_path * faster
        moving = Reference(q_path, self.grip * v_path * self.rate, self.grip * a_along)
        self.tau = self.strength.torque(q, v, moving, self.grip)
        return self.strength.reference(q, v, moving, self.tau)

    def _at(self, place: float) -> tuple[Joints, Joints, Joints]:
        """Position, velocity and acceleration of the path between two ticks."""
        k = min(int(place), len(self.path) - 2)
        s, now, then = place - k, self.path.at(k), self.path.at(k + 1)
        q, v, a = ((1.0 - s) * one + s * other for one, other in zip(now, then, strict=True))
        return q, v, a


class Anchor:
    """Anchor that grips a floating arm where it is: the pull rises, and the target follows an arm that still moves."""

    def __init__(self, q: Joints, strength: PullStrength, dt: float):
        """Prepare the anchor for an arm at `q` [rad], without pull."""
        self._strength, self._dt = strength, dt
        self.lets_go = False
        """True if the arm is being released."""
        self.grip = 0.0
        """Share of the pull that acts."""
        self.target = q.copy()
        """Target position of the arm [rad]."""

    def let_go(self) -> None:
        """Release the arm, as `PathGuide` does."""
        self.lets_go = True

    def __call__(self, q: Joints, v: Joints) -> Reference:
        """Return the reference for the control law, as `PathGuide` does."""
        slack = FREE * REACH_RAD
        self.target = np.clip(self.target, q - slack, q + slack)
        more = -1.0 / DROP_S if self.lets_go else 1.0 / GRIP_S
        self.grip = min(max(self.grip + self._dt * more, 0.0), 1.0)
        still = np.zeros_like(q)
        there = Reference(self.target, still, still)
        return self._strength.reference(q, v, there, self._strength.torque(q, v, there, self.grip))
