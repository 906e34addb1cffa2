"""One arm leads, floated; the other follows its mirror image: late, no faster than allowed, and never hard."""

import numpy as np
from jaxtyping import Float

from exograv.signals import Reference

from .grip import FREE, GripOutcome, next_grip, pace
from .mirror_map import MirrorMap
from .path_shaping import A_MAX_RAD_S2, V_MAX_RAD_S
from .pull import REACH_RAD, PullStrength

Joints = Float[np.ndarray, " joint"]
OfOneArm = Float[np.ndarray, " lead"]

CLOSING_PER_S = 8.0
"""Speed of the following arm's place over how far it is behind: an eighth of a second late."""

SETTLES_S = 0.05
"""In which that speed is taken up, where `A_MAX_RAD_S2` allows."""

RUSH_RAD_S = 2.0
"""Of a joint of the leading arm: a jerk, by which whoever leads ends it."""

BEHIND_RAD = np.deg2rad(30.0)
"""By which the place may fall behind the mirror image, once it has been there: the tunnel."""

TOGETHER_RAD = np.deg2rad(5.0)
"""Behind by less, the arms have met for the first time."""


class MirrorGuide:
    """As `PathGuide`, for a machine with two arms; one call a tick."""

    def __init__(
        self,
        which: MirrorMap,
        strength: PullStrength,
        limits: tuple[Joints, Joints],
        q: Joints,
        dt: float,
    ):
        """Nothing is led yet: `lead` does.

        Args:
            which: Leads and follows.
            strength: Of the pull, all joints of the machine.
            limits: Where joints may be led to, lower and upper [rad].
            q: Where the joints are [rad].
            dt: Period [s].
        """
        self.which, self.strength = which, strength
        self._lower, self._upper = (bound[which.follow] for bound in limits)
        self._dt = dt
        self.state, self.grip = GripOutcome.FREE, 0.0
        self.target = q.copy()
        """Where the following arm should be [rad]; the leading one is where it wants."""
        self.v_target = np.zeros_like(q)
        self.tau = np.zeros_like(q)
        """Pull at the last tick [N·m]; none at the leading arm."""
        self.waits = False
        """Set while the hands are too near to each other to go on."""
        self._is_held = False
        self.has_met = False
        """Whether the following arm's place was at the mirror image once."""

    def lead(self) -> None:
        """From now on one follows the other."""
        self.state = GripOutcome.LED

    def let_go(self) -> None:
        """Somebody, by either arm, wants it to end."""
        if self.state is GripOutcome.LED:
            self.state = GripOutcome.RELEASED

    @property
    def has_let_go(self) -> bool:
        """Whether nothing pulls any more, because the arm was let go."""
        return self.state not in (GripOutcome.FREE, GripOutcome.LED) and self.grip == 0.0

    def __call__(self, q: Joints, v: Joints) -> Reference:
        """What control is to follow with the arms at `q` [rad], moving with `v` [rad/s]."""
        follow, dt = self.which.follow, self._dt
        strain = float(np.abs(self.target - q)[follow].max()) / REACH_RAD
        self._watch(q, v)
        self.grip, self.state = next_grip(self.grip, self.state, strain, dt)
        wanted = np.clip(self.which.mirrored(q)[follow], self._lower, self._upper)
        a = self._go_on(wanted, q, strain)
        moving = Reference(q.copy(), np.zeros_like(q), np.zeros_like(q))
        moving.q[follow] = self.target[follow]
        # What an arm that is let go gets for this motion goes with the pull, without a step.
        moving.v[follow], moving.a[follow] = self.grip * self.v_target[follow], self.grip * a
        # The leading arm floats: control drives the other one alone (`ArmController.let_lead`).
        self.tau = np.zeros_like(q)
        self.tau[follow] = self.strength.torque(q, v, moving, self.grip)[follow]
        return self.strength.reference(q, v, moving, self.tau)

    def _watch(self, q: Joints, v: Joints) -> None:
        """Whether the leading arm is one that may be followed."""
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
        """Move the following arm's place towards `wanted` [rad]; its acceleration [rad/s²]."""
        follow, dt = self.which.follow, self._dt
        place, speed = self.target[follow], self.v_target[follow]
        if self.state is not GripOutcome.LED:
            return np.zeros_like(speed)
        left = wanted - place
        # No faster than it could stop in what is left.
        fastest = np.minimum(V_MAX_RAD_S, np.sqrt(2.0 * 0.8 * A_MAX_RAD_S2 * np.abs(left)))
        goes = 0.0 if self.waits else pace(strain)
        v_wanted = goes * np.clip(CLOSING_PER_S * left, -fastest, fastest)
        a = np.clip((v_wanted - speed) / SETTLES_S, -A_MAX_RAD_S2, A_MAX_RAD_S2)
        speed = speed + dt * a
        place = place + dt * speed
        self._is_held = self._is_held or self.grip == 1.0
        if not self._is_held:
            # Whoever is being taken hold of may still move on.
            slack = FREE * REACH_RAD
            place = np.clip(place, q[follow] - slack, q[follow] + slack)
        self.target[follow], self.v_target[follow] = place, speed
        return a
