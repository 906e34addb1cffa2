"""Mirror guide: one arm floats and leads; the other one follows its mirror image with limited speed and torque."""

from collections.abc import Callable

import numpy as np
from jaxtyping import Float

from exograv.model.description import ArmSide
from exograv.signals import Reference

from .grip import FREE, GripOutcome, next_grip, pace
from .mirror_map import MirrorMap
from .path_shaping import A_MAX_RAD_S2, V_MAX_RAD_S
from .pull import REACH_RAD, PullStrength

Joints = Float[np.ndarray, " joint"]
OfOneArm = Float[np.ndarray, " lead"]

CLOSING_PER_S = 8.0
"""Speed of the following target per distance [1/s], which gives a delay of an eighth of a second."""

SETTLES_S = 0.05
"""Time constant with which the target takes up that speed, if `A_MAX_RAD_S2` allows [s]."""

RUSH_RAD_S = 2.0
"""Speed of a leading joint that counts as a jerk [rad/s]. With a jerk the person ends the session."""

BEHIND_RAD = np.deg2rad(30.0)
"""Largest distance of the target from the mirror image once it has been there [rad]: the tunnel."""

TOGETHER_RAD = np.deg2rad(5.0)
"""Distance below which the target has met the mirror image for the first time [rad]."""

MIDDLE_M = 0.10
"""Least distance of the leading hand from the plane between the shoulders [m]. Closer hands could collide."""

LOOK_TICKS = 20
"""Ticks between two checks of the hands' positions."""


class MirrorGuide:
    """Guide like `PathGuide` for a machine with two arms; call it once per tick."""

    def __init__(
        self,
        which: MirrorMap,
        strength: PullStrength,
        limits: tuple[Joints, Joints],
        q: Joints,
        dt: float,
        side: ArmSide,
        to_middle: Callable[[Joints], float] = lambda _q: np.inf,
    ):
        """Prepare the guide; guidance starts with `lead`.

        Args:
            which: Leading and following joints.
            strength: Strength of the pull, for all joints of the machine.
            limits: Lower and upper limits of the target [rad].
            q: Present joint positions [rad].
            dt: Period [s].
            side: Leading arm.
            to_middle: Function of the joint positions [rad] that returns the distance of the leading hand from the
                plane between the shoulders [m].
        """
        self.which, self.strength = which, strength
        self.side: ArmSide = side
        self._to_middle, self._ticks = to_middle, 0
        self._lower, self._upper = (bound[which.follow] for bound in limits)
        self._dt = dt
        self.state, self.grip = GripOutcome.FREE, 0.0
        self.target = q.copy()
        """Target of the following arm [rad]; the leading arm moves freely."""
        self.v_target = np.zeros_like(q)
        self.tau = np.zeros_like(q)
        """Pull at the last tick [N·m]; zero at the leading arm."""
        self.waits = False
        """True while the hands are too close together to proceed."""
        self.waited_s = 0.0
        """Time during which the hands were too close together to proceed [s]."""
        self._is_held = False
        self.has_met = False
        """True once the target was at the mirror image."""

    def lead(self) -> None:
        """Begin to guide the following arm."""
        self.state = GripOutcome.LED

    def let_go(self) -> None:
        """Release the arm on request of the person or an operator."""
        if self.state is GripOutcome.LED:
            self.state = GripOutcome.RELEASED

    @property
    def has_let_go(self) -> bool:
        """True if the arm was released and the pull is zero."""
        return self.state not in (GripOutcome.FREE, GripOutcome.LED) and self.grip == 0.0

    def __call__(self, q: Joints, v: Joints) -> Reference:
        """Return the reference for the control law with the arms at `q` [rad] and joint velocity `v` [rad/s]."""
        follow, dt = self.which.follow, self._dt
        strain = float(np.abs(self.target - q)[follow].max()) / REACH_RAD
        self._look_at_hands(q)
        self._watch(q, v)
        self.grip, self.state = next_grip(self.grip, self.state, strain, dt)
        wanted = np.clip(self.which.mirrored(q)[follow], self._lower, self._upper)
        a = self._go_on(wanted, q, strain)
        moving = Reference(q.copy(), np.zeros_like(q), np.zeros_like(q))
        moving.q[follow] = self.target[follow]
        # The feed-forward of the target's motion fades with the pull, so that a release makes no torque step.
        moving.v[follow], moving.a[follow] = self.grip * self.v_target[follow], self.grip * a
        # The leading arm floats: the controller drives only the following arm (`ArmController.let_lead`).
        self.tau = np.zeros_like(q)
        self.tau[follow] = self.strength.torque(q, v, moving, self.grip)[follow]
        return self.strength.reference(q, v, moving, self.tau)

    def _look_at_hands(self, q: Joints) -> None:
        if self._ticks % LOOK_TICKS == 0:
            self.waits = self._to_middle(q) < MIDDLE_M
        self._ticks += 1
        self.waited_s += self._dt * self.waits

    def _watch(self, q: Joints, v: Joints) -> None:
        """End the guidance if the leading arm moves with a jerk or is too far ahead."""
        lead, follow = self.which.lead, self.which.follow
        wanted = np.clip(self.which.mirrored(q)[follow], self._lower, self._upper)
        behind = float(np.abs(wanted - self.target[follow]).max())
        self.has_met = self.has_met or behind < TOGETHER_RAD
        if self.state is not GripOutcome.LED:
            return
        if float(np.abs(v[lead]).max()) > RUSH_RAD_S:
            self.state = GripOutcome.RUSHED
        elif self.has_met and not self.waits and behind > BEHIND_RAD:
            self.state = GripOutcome.LOST

    def _go_on(self, wanted: OfOneArm, q: Joints, strain: float) -> OfOneArm:
        """Move the target of the following arm towards `wanted` [rad], and return its acceleration [rad/s²]."""
        follow, dt = self.which.follow, self._dt
        place, speed = self.target[follow], self.v_target[follow]
        if self.state is not GripOutcome.LED:
            return np.zeros_like(speed)
        left = wanted - place
        # The speed is low enough to stop within the remaining distance.
        fastest = np.minimum(V_MAX_RAD_S, np.sqrt(2.0 * 0.8 * A_MAX_RAD_S2 * np.abs(left)))
        goes = 0.0 if self.waits else pace(strain)
        v_wanted = goes * np.clip(CLOSING_PER_S * left, -fastest, fastest)
        a = np.clip((v_wanted - speed) / SETTLES_S, -A_MAX_RAD_S2, A_MAX_RAD_S2)
        speed = speed + dt * a
        place = place + dt * speed
        self._is_held = self._is_held or self.grip == 1.0
        if not self._is_held:
            # During the grip the person may still move on, so the target stays close to the arm.
            slack = FREE * REACH_RAD
            place = np.clip(place, q[follow] - slack, q[follow] + slack)
        self.target[follow], self.v_target[follow] = place, speed
        return a
