"""A wearer of little strength, as after a stroke: less torque, never quite the same, an elbow that lifting bends.

    tau = clip(tau_wanted, ± mobilised · strength · torque_max) · (1 + noise)
    tau_elbow += synergy · |lifting torque of the shoulder|

What remains of a muscle's strength, and how much of it one attempt mobilises, is the person's; the machine never knows.
It shows that the software works and is no evidence about people.
"""

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float

from exograv.model.limb import FREEDOMS
from exograv.motion import Trajectory
from exograv.rig.twin.disturbances.streams import stream
from exograv.rig.twin.wearer.wearer import Wearer

from .acting_wearer import ActingWearer, Physiology, usual_physiology

PerFreedom = Float[np.ndarray, " arm"]

STRENGTH_SPREAD = 0.2
"""Between the freedoms of one arm, SD of the logarithm. Source: one person's muscle groups are hit very unequally, the
means over people from 0.52 to 0.73 of the other arm (PubMed 15053131, abstract); the
number is assumed."""

FLEXION, ABDUCTION, ELBOW = (FREEDOMS.index(name) for name in ("flexion", "abduction", "elbow"))


@dataclass(frozen=True)
class Weakness:
    """What is left of one arm's muscles."""

    strength: PerFreedom
    """Of a healthy adult's greatest torque, `USUAL` (arm,) [-]. Source: some half is lost on average in chronic
    stroke, 52 % of the shoulder's peak torque (Braz J Phys Ther 2014, 18:3, abstract). Whoever cannot lift the arm has
    far less than the other half: those are the people of this test."""

    synergy: float = 0.0
    """Torque that bends the elbow over the torque with which the shoulder lifts [-]; 0 is none. That lifting bends the
    elbow, more the stronger it is: PMC2827935, abstract; in flexion of the
    shoulder too: PMC11674131. Its size here is unverified."""

    mobilised_sd: float = 0.1
    """Of the share of the strength that an attempt falls short by; half a normal distribution [-]. Unverified: the
    standard error of such torques measured again is 0 to 34 % (Kim, J Neurol Phys Ther, abstract)."""

    noise: float = 0.05
    """Of a muscle's torque, SD as a share [-]; assumed, more than a healthy participant's."""

    noise_s: float = 0.2
    """How long it lasts [s]; assumed."""


def drawn_weakness(strength: float, seed: int, freedoms: int, synergy: float = 0.0) -> Weakness:
    """Somebody with this strength [-] on average, whose freedoms differ."""
    spread = np.exp(STRENGTH_SPREAD * stream(seed, "wearer", "strength").standard_normal(freedoms))
    return Weakness(np.minimum(strength * spread, 1.0), synergy)


def weakened(wearer: Wearer, weakness: Weakness) -> Wearer:
    """The same person with weak muscles: whatever they do unasked is weaker too."""
    arm = wearer.arms[0]
    unrest = replace(
        arm.unrest,
        bias_rms=arm.unrest.bias_rms * weakness.strength,
        burst_share=arm.unrest.burst_share * weakness.strength,
    )
    return replace(wearer, arms=(replace(arm, unrest=unrest),))


def weak_physiology(weakness: Weakness) -> Physiology:
    """Muscles of the remaining strength, as stiff as a healthy person's while they can."""
    usual = usual_physiology(len(weakness.strength))
    return replace(usual, torque_max=weakness.strength * usual.torque_max)


class WeakWearer:
    """An `ActingWearer` of little strength."""

    def __init__(self, weakness: Weakness, period_s: float, random: np.random.Generator):
        """Relaxed; `random` draws how much each attempt mobilises, and all noise."""
        self.weakness = weakness
        body = weak_physiology(weakness)
        self._muscles, self._most = ActingWearer(body, period_s), body.torque_max
        self._random, self._keeps = random, float(np.exp(-period_s / weakness.noise_s))
        self._kick = weakness.noise * float(np.sqrt(1.0 - self._keeps**2))
        self._noise = np.zeros(len(body.torque_max))
        self._mobilised = 1.0

    def attempt(self) -> None:
        """Draw what the next attempt mobilises: never more than there is."""
        short = self.weakness.mobilised_sd * abs(float(self._random.standard_normal()))
        self._mobilised = max(0.0, 1.0 - short)

    def want(self, movement: Trajectory, anticipated: Float[np.ndarray, "tick arm"], t: float) -> None:
        """As `ActingWearer.want`."""
        self._muscles.want(movement, anticipated, t)

    def step(self, t: float, q_arm: PerFreedom, v_arm: PerFreedom) -> PerFreedom:
        """Muscle torque (arm,) [N·m] at time `t` [s] with the arm at `q_arm` [rad], moving with `v_arm` [rad/s]."""
        self._noise = self._keeps * self._noise + self._kick * self._random.standard_normal(len(self._noise))
        limit = self._mobilised * self._most
        tau = (1.0 + self._noise) * np.clip(self._muscles.step(t, q_arm, v_arm), -limit, limit)
        tau[ELBOW] += involuntary(self.weakness, self._most, tau)
        return tau


def involuntary(weakness: Weakness, torque_max: PerFreedom, tau: PerFreedom) -> float:
    """Torque [N·m] that bends the elbow while the shoulder lifts with `tau` [N·m]; no more than the elbow has."""
    lifting = float(np.hypot(max(tau[FLEXION], 0.0), max(tau[ABDUCTION], 0.0)))
    return min(weakness.synergy * lifting, float(torque_max[ELBOW]))
