"""A wearer who acts: muscles take the arm along a wanted movement by anticipation, elasticity and late reflexes.

    tau = lag(anticipated(t) + reflex(t − delay) + hold) + stiffness · (q_wanted − q) + damping · (v_wanted − v)

It knows where its own arm is and what it wants, never what the machine does. What it anticipates is learned by practice
(`practice`) or comes from a model of the own arm (`own_arm`); either may be wrong.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from exograv.motion import Trajectory

PerFreedom = Float[np.ndarray, " arm"]
Table = Float[np.ndarray, "tick arm"]


@dataclass(frozen=True)
class Physiology:
    """Muscles and nerves of one arm, one entry per freedom where not a single number."""

    stiffness: PerFreedom
    """Of contracted muscles against being moved off the wanted path, at once [N·m/rad]."""

    damping: PerFreedom
    """The same against speed [N·m·s/rad]."""

    torque_max: PerFreedom
    """[N·m]"""

    reflex_share: float = 0.5
    """Reflex over elastic torque at the same error [-]. Assumed; below 1 the delay cannot make it unstable."""

    delay: float = 0.06
    """Of the reflex [s]. Source: long-latency responses of shoulder, elbow and wrist come 50–100 ms after a
    perturbation, https://ir.lib.uwo.ca/brainpub/781/ (abstract)."""

    muscle_lag: float = 0.04
    """From command to torque, time constant [s]. Unverified: models of the arm use 30–60 ms."""

    hold_rate: float = 1.0
    """How quickly a lasting error makes the arm hold against it, of `stiffness` [1/s]. Assumed; that the torque which
    holds a posture is an integral: Albert et al. (2020), eLife 9:e52507."""

    hold_threshold: float = float(np.deg2rad(0.8))
    """Smaller errors are not felt and change no holding torque [rad]. Source: joint-angle SD of proprioception
    0.6–1.1°, van Beers et al. (1998)."""


# Stiffness of shoulder and elbow in posture and reaching: some 10–30 N·m/rad, growing with torque (Gomi & Osu 1998, J
# Neurosci 18:8965, abstract; the numbers are unverified). Rotation, roll and wrist are assumed, by moment of inertia.
# Strength: static flexion 69–90 N·m in men, half of it in women ("Dynamic shoulder flexion strength for use in
# occupational risk analysis", abstract); elbow and shoulder 40–60 N·m, unverified; the others assumed.
USUAL = {
    "flexion": (20.0, 2.5, 60.0),
    "abduction": (20.0, 2.5, 40.0),
    "rotation": (12.0, 1.0, 30.0),
    "elbow": (14.0, 1.2, 50.0),
    "forearm_roll": (1.5, 0.08, 8.0),
    "wrist_flexion": (2.0, 0.10, 10.0),
    "wrist_deviation": (2.0, 0.10, 10.0),
}
"""Stiffness [N·m/rad], damping [N·m·s/rad] and strength [N·m] by freedom of the arm."""


def usual_physiology(freedoms: int) -> Physiology:
    """Of an arm with the first 4 or all 7 freedoms of `USUAL`, or of two such arms."""
    of_one = freedoms if freedoms in (4, len(USUAL)) else freedoms // 2
    stiffness, damping, torque_max = np.array(list(USUAL.values())[:of_one] * (freedoms // of_one)).T
    return Physiology(stiffness, damping, torque_max)


class ActingWearer:
    """Wants a movement and makes the torque for it, one `step` a period; it goes into `Twin.tau_voluntary`."""

    def __init__(self, physiology: Physiology, period_s: float):
        """Relaxed: it wants nothing yet and gives no torque."""
        n = len(physiology.stiffness)
        self.physiology, self._period = physiology, period_s
        self._wanted: Trajectory | None = None
        self._anticipated: Table = np.zeros((1, n))
        self._begin = 0.0
        self._late = np.zeros((max(1, round(physiology.delay / period_s)), 2, n))
        self._ticks = 0
        self._follow = 1.0 - np.exp(-period_s / physiology.muscle_lag)
        self._active = np.zeros(n)
        self.hold = np.zeros(n)
        """What it has come to hold against (arm,) [N·m]."""
        self.trusts_anticipation = False
        """Set while a movement is learned: what lasts is anticipated then, and two that learn the same would fight."""
        self.tension = np.ones(n)
        """Stiffness and damping over those of `physiology` (arm,) [-]: antagonists that are tensed together."""
        self.error = np.zeros(n)
        """Wanted minus true position at the last step (arm,) [rad]."""

    def want(self, movement: Trajectory, anticipated: Table, t: float) -> None:
        """Begin a movement at time `t`; its last posture is kept after its end.

        Args:
            movement: Of the arm's freedoms, tabled at the wearer's period.
            anticipated: Torque that the wearer expects it to need (tick, arm), or one row for all of it [N·m].
            t: On the clock of `step` [s].
        """
        self._wanted, self._anticipated, self._begin = movement, anticipated, t

    def step(self, t: float, q_arm: PerFreedom, v_arm: PerFreedom) -> PerFreedom:
        """Muscle torque (arm,) [N·m] at time `t` [s] with the arm at `q_arm` [rad], moving with `v_arm` [rad/s]."""
        if self._wanted is None:
            return np.zeros_like(q_arm)
        body, tick = self.physiology, max(round((t - self._begin) / self._period), 0)
        anticipated = self._anticipated[min(tick, len(self._anticipated) - 1)]
        v_wanted = self._wanted.v[tick] if tick < len(self._wanted) else 0.0
        self.error = self._wanted.q[min(tick, len(self._wanted) - 1)] - q_arm
        elastic = self.tension * (body.stiffness * self.error + body.damping * (v_wanted - v_arm))
        late_error, late_elastic = self._delayed(self.error, elastic)
        felt = late_error - np.clip(late_error, -body.hold_threshold, body.hold_threshold)
        if not self.trusts_anticipation:
            self.hold = self._within_strength(self.hold + self._period * body.hold_rate * body.stiffness * felt)
        command = self._within_strength(anticipated + body.reflex_share * late_elastic + self.hold)
        self._active += self._follow * (command - self._active)
        return self._within_strength(self._active + elastic)

    def _delayed(self, error: PerFreedom, elastic: PerFreedom) -> tuple[PerFreedom, PerFreedom]:
        """What the nerves report now: both as they were one delay ago, against what was wanted then."""
        place = self._late[self._ticks % len(self._late)]
        late = place.copy()
        place[0], place[1] = error, elastic
        self._ticks += 1
        return late[0], late[1]

    def _within_strength(self, tau: PerFreedom) -> PerFreedom:
        return np.clip(tau, -self.physiology.torque_max, self.physiology.torque_max)
