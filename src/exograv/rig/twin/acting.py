"""A wearer who acts: muscles take the arm along a wanted movement by anticipation, elasticity and late reflexes.

    tau = lag(tau_anticipated(t) + reflex(t − delay) + hold) + stiffness · (q_wanted − q) + damping · (v_wanted − v)

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
    """Reflex over elastic torque at the same error [-]. Assumed: below 1 the delayed loop is stable whatever it holds."""

    delay: float = 0.06
    """Of the reflex [s]. Source: long-latency responses of shoulder, elbow and wrist come 50–100 ms after a perturbation,
    https://ir.lib.uwo.ca/brainpub/781/ (abstract)."""

    muscle_lag: float = 0.04
    """From command to torque, time constant [s]. Unverified: arm models use 30–60 ms."""

    hold_rate: float = 1.0
    """How quickly a lasting error makes the arm hold against it, of `stiffness` [1/s]. Assumed; that the torque which
    holds a posture is an integral: Albert et al. (2020), eLife 9:e52507."""

    hold_threshold: float = np.deg2rad(0.8)
    """Smaller errors are not felt and change no holding torque [rad]. Source: joint-angle SD of proprioception
    0.6–1.1°, van Beers et al. (1998)."""


# Stiffness of shoulder and elbow in posture and reaching is some 10–30 N·m/rad and grows with torque (Gomi & Osu 1998, J
# Neurosci 18:8965, abstract; the numbers are unverified). Rotation, roll and wrist: assumed, by their moments of inertia.
# Strength: static flexion 69–90 N·m in men, half of it in women ("Dynamic shoulder flexion strength for use in
# occupational risk analysis", abstract); elbow and shoulder 40–60 N·m, unverified; the others assumed.
USUAL = {
    "flexion": (16.0, 2.0, 60.0),
    "abduction": (16.0, 2.0, 40.0),
    "rotation": (8.0, 0.8, 30.0),
    "elbow": (10.0, 1.0, 50.0),
    "forearm_roll": (1.5, 0.08, 8.0),
    "wrist_flexion": (2.0, 0.10, 10.0),
    "wrist_deviation": (2.0, 0.10, 10.0),
}
"""Stiffness [N·m/rad], damping [N·m·s/rad] and strength [N·m] by freedom of the arm."""


def usual_physiology(freedoms: int) -> Physiology:
    """Of an arm with this many freedoms: the first of `USUAL`, twice over for two arms of them."""
    for arms in (1, 2):
        of_one, rest = divmod(freedoms, arms)
        if rest == 0 and of_one in (4, len(USUAL)):
            return Physiology(*np.array(list(USUAL.values())[:of_one] * arms).T)
    raise ValueError(f"No arm has {freedoms} freedoms.")


class ActingWearer:
    """Wants a movement and makes the torque for it; one `step` a period."""

    def __init__(self, physiology: Physiology, period_s: float):
        """At rest, wanting nothing: without a movement it gives no torque but what it holds."""
        n = len(physiology.stiffness)
        self.physiology, self._period = physiology, period_s
        self._wanted: Trajectory | None = None
        self._anticipated: Table = np.zeros((1, n))
        self._begin = 0.0
        self._late = np.zeros((max(1, round(physiology.delay / period_s)), 2, n))
        self._ticks = 0
        self._hold, self._command = np.zeros(n), np.zeros(n)
        self._follow = 1.0 - np.exp(-period_s / physiology.muscle_lag)
        self.error = np.zeros(n)
        """Wanted minus true position at the last step (arm,) [rad]."""

    def want(self, movement: Trajectory, anticipated: Table, t: float) -> None:
        """Begin a movement at time `t` [s]; its last posture is held after its end.

        Args:
            movement: Of the arm's freedoms, tabled at the wearer's period.
            anticipated: Torque that the wearer expects it to need (tick, arm), or (1, arm) for all of it [N·m].
            t: On the clock of `step` [s].
        """
        self._wanted, self._anticipated, self._begin = movement, anticipated, t

    @property
    def hold(self) -> PerFreedom:
        """What it has learned to hold against [N·m]."""
        return self._hold

    def step(self, t: float, q_arm: PerFreedom, v_arm: PerFreedom) -> PerFreedom:
        """Muscle torque (arm,) [N·m] at time `t` [s], for the arm's present position [rad] and velocity [rad/s]."""
        body = self.physiology
        if self._wanted is None:
            return self._muscle(self._hold)
        k = min(max(round((t - self._begin) / self._period), 0), len(self._wanted) - 1)
        has_ended = k == len(self._wanted) - 1
        self.error = self._wanted.q[k] - q_arm
        slip = (0.0 if has_ended else self._wanted.v[k]) - v_arm
        late_error, late_slip = self._delayed(self.error, slip)
        felt = late_error - np.clip(late_error, -body.hold_threshold, body.hold_threshold)
        self._hold = np.clip(
            self._hold + self._period * body.hold_rate * body.stiffness * felt, -body.torque_max, body.torque_max
        )
        reflex = body.reflex_share * (body.stiffness * late_error + body.damping * late_slip)
        anticipated = self._anticipated[min(k, len(self._anticipated) - 1)]
        elastic = body.stiffness * self.error + body.damping * slip
        return np.clip(self._muscle(anticipated + reflex + self._hold) + elastic, -body.torque_max, body.torque_max)

    def _muscle(self, command: PerFreedom) -> PerFreedom:
        limit = self.physiology.torque_max
        self._command += self._follow * (np.clip(command, -limit, limit) - self._command)
        return self._command.copy()

    def _delayed(self, error: PerFreedom, slip: PerFreedom) -> tuple[PerFreedom, PerFreedom]:
        """What the nerves report now: errors of position and velocity one delay ago, against what was wanted then."""
        place = self._late[self._ticks % len(self._late)]
        late = place.copy()
        place[0], place[1] = error, slip
        self._ticks += 1
        return late[0], late[1]
