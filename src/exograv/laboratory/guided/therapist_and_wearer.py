"""Simulated therapist who moves the machine by hand, and simulated wearer.

Both read the twin's true state, because people feel where their hands are. The controller has no access to them.
"""

import itertools
from collections.abc import Sequence

import numpy as np
from jaxtyping import Float

from exograv import motion
from exograv.model.description import RigDescription
from exograv.motion import Trajectory
from exograv.rig.twin import Twin

Joints = Float[np.ndarray, " joint"]

HAND_KP, HAND_KD = 60.0, 8.0
"""Stiffness and damping of a therapist who moves an arm by its cuffs [N·m/rad, N·m·s/rad] (assumed)."""

HAND_MAX_NM = 20.0
"""Largest torque of a therapist who moves a patient's arm (assumed)."""

HOLDS_KP, HOLDS_KD = 30.0, 3.0
"""Stiffness and damping of an arm that is held still, as in `cooperative_wearer` [N·m/rad, N·m·s/rad]."""


class Therapist:
    """Therapist who moves joints of the machine along a movement. Call `act` once per tick."""

    def __init__(self, twin: Twin, movement: Trajectory, joints: slice = slice(None)):
        """Start the movement now. Its columns belong to `joints`."""
        self._twin, self._movement, self._joints, self._tick = twin, movement, joints, 0

    def act(self) -> None:
        """Set the hand's torque for the next period. After the movement the hand holds the arm."""
        hand, tick = self._twin.tau_hand[self._joints], min(self._tick, len(self._movement) - 1)
        truth, q, v = self._twin.truth, self._movement.q[tick], self._movement.v[tick]
        wanted = HAND_KP * (q - truth.q[self._joints]) + HAND_KD * (v - truth.v[self._joints])
        hand[:] = np.clip(wanted, -HAND_MAX_NM, HAND_MAX_NM)
        self._tick += 1

    def let_go(self) -> None:
        """Remove the hand's torque."""
        self._twin.tau_hand[self._joints] = 0.0


class Holding:
    """Wearer who holds the arm still between two times, and is relaxed otherwise. Call `act` once per tick."""

    def __init__(self, twin: Twin, from_s: float, until_s: float, freedoms: slice = slice(None)):
        """Set the times on the twin's clock [s], and the freedoms of the arms that are held."""
        self._twin, self._from, self._until, self._held = twin, from_s, until_s, freedoms
        self._q: np.ndarray | None = None

    def act(self) -> None:
        """Set the muscle torque for the next period."""
        twin, tau = self._twin, self._twin.tau_voluntary[self._held]
        if not self._from <= twin.t < self._until:
            if self._q is not None:
                self._q, tau[:] = None, 0.0
            return
        truth = twin.truth
        q, v = truth.q_arm[self._held], truth.v_arm[self._held]
        self._q = q if self._q is None else self._q
        tau[:] = HOLDS_KP * (self._q - q) - HOLDS_KD * v


def drawn_movement(description: RigDescription, seed: int, q: Joints, dt: float, stops: int = 3) -> Trajectory:
    """Draw the movement of a simulated therapist: from `q` [rad] over some postures in the task workspace and back.

    On a machine for two arms, the columns of both arms are the same.
    """
    lower, upper = description.workspace
    arms = len(description.arm_sides)
    rng, of_one = np.random.default_rng([seed, 73]), len(lower) // arms
    spots = [np.tile(rng.uniform(0.15, 0.85, of_one), arms) for _ in range(stops)]
    way = [q, *(lower + spot * (upper - lower) for spot in spots), q]
    parts = [motion.hold(q, 0.5, dt)]
    for start, goal in itertools.pairwise(way):
        parts += [motion.go_to(start, goal, 0.8, dt), motion.hold(goal, 0.3, dt)]
    return motion.joined(parts)


def of_joints(movement: Trajectory, joints: Sequence[int]) -> Trajectory:
    """Return the part of a movement that belongs to some joints."""
    own = list(joints)
    q, v, a = (table[:, own] for table in (movement.q, movement.v, movement.a))
    return Trajectory(q, v, a, movement.dt)
