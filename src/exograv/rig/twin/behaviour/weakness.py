"""Wearer of little strength, as after a stroke: less torque, variable torque, and an elbow that bends when lifting.

    tau = clip(tau_wanted, ± mobilised · strength · torque_max) · (1 + noise)
    tau_elbow += synergy · |lifting torque of the shoulder|

The remaining strength, and the share of it that one attempt mobilises, are properties of the person; the machine never
knows them. The model tests the software and is no evidence about people.
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
"""Spread of strength between the freedoms of one arm, SD of the logarithm.

Source: one person's muscle groups are hit very unequally, the means over people from 0.52 to 0.73 of the other arm
(PubMed 15053131, abstract); the number is assumed.
"""

FLEXION, ABDUCTION, ELBOW = (FREEDOMS.index(name) for name in ("flexion", "abduction", "elbow"))


@dataclass(frozen=True)
class Weakness:
    """Remaining function of one arm's muscles."""

    strength: PerFreedom
    """Strength over a healthy adult's greatest torque, `USUAL` (arm,) [-].

    Source: on average about half is lost in chronic stroke, 52 % of the shoulder's peak torque (Braz J Phys Ther 2014,
    18:3, abstract). People who cannot lift the arm have far less than the other half; this test is about them.
    """

    synergy: float = 0.0
    """Ratio of the torque that bends the elbow to the torque with which the shoulder lifts [-]; 0 for none.

    Lifting bends the elbow, more so at higher torque: PMC2827935, abstract; in flexion of the shoulder too:
    PMC11674131. The value is unverified.
    """

    mobilised_sd: float = 0.1
    """SD of the share of strength that an attempt lacks; half a normal distribution [-].

    Unverified: the standard error of such torques measured again is 0 to 34 % (Kim, J Neurol Phys Ther, abstract).
    """

    noise: float = 0.05
    """Noise of a muscle's torque, SD as a share [-]; assumed, larger than a healthy participant's."""

    noise_s: float = 0.2
    """Correlation time of the noise [s]; assumed."""


def drawn_weakness(strength: float, seed: int, freedoms: int, synergy: float = 0.0) -> Weakness:
    """Draw the weakness of a person with this mean strength [-] and differences between freedoms."""
    spread = np.exp(STRENGTH_SPREAD * stream(seed, "wearer", "strength").standard_normal(freedoms))
    return Weakness(np.minimum(strength * spread, 1.0), synergy)


def weakened(wearer: Wearer, weakness: Weakness) -> Wearer:
    """Return the same person with weak muscles; involuntary torque is weaker, too."""
    arm = wearer.arms[0]
    unrest = replace(
        arm.unrest,
        bias_rms=arm.unrest.bias_rms * weakness.strength,
        burst_share=arm.unrest.burst_share * weakness.strength,
    )
    return replace(wearer, arms=(replace(arm, unrest=unrest),))


def weak_physiology(weakness: Weakness) -> Physiology:
    """Return muscles with the remaining strength; within it they are as stiff as those of a healthy person."""
    usual = usual_physiology(len(weakness.strength))
    return replace(usual, torque_max=weakness.strength * usual.torque_max)


class WeakWearer:
    """`ActingWearer` of little strength."""

    def __init__(self, weakness: Weakness, period_s: float, random: np.random.Generator):
        """Start relaxed; `random` draws the mobilised share of each attempt, and all noise."""
        self.weakness = weakness
        body = weak_physiology(weakness)
        self._muscles, self._most = ActingWearer(body, period_s), body.torque_max
        self._random, self._keeps = random, float(np.exp(-period_s / weakness.noise_s))
        self._kick = weakness.noise * float(np.sqrt(1.0 - self._keeps**2))
        self._noise = np.zeros(len(body.torque_max))
        self._mobilised = 1.0

    def attempt(self) -> None:
        """Draw the share of strength that the next attempt mobilises; never more than 1."""
        short = self.weakness.mobilised_sd * abs(float(self._random.standard_normal()))
        self._mobilised = max(0.0, 1.0 - short)

    def want(self, movement: Trajectory, anticipated: Float[np.ndarray, "tick arm"], t: float) -> None:
        """Start a movement, as in `ActingWearer.want`."""
        self._muscles.want(movement, anticipated, t)

    def step(self, t: float, q_arm: PerFreedom, v_arm: PerFreedom) -> PerFreedom:
        """Muscle torque (arm,) [N·m] at time `t` [s] with the arm at `q_arm` [rad], moving with `v_arm` [rad/s]."""
        self._noise = self._keeps * self._noise + self._kick * self._random.standard_normal(len(self._noise))
        limit = self._mobilised * self._most
        tau = (1.0 + self._noise) * np.clip(self._muscles.step(t, q_arm, v_arm), -limit, limit)
        tau[ELBOW] += involuntary(self.weakness, self._most, tau)
        return tau


def involuntary(weakness: Weakness, torque_max: PerFreedom, tau: PerFreedom) -> float:
    """Torque [N·m] that bends the elbow while the shoulder lifts with `tau` [N·m], limited by the elbow's strength."""
    lifting = float(np.hypot(max(tau[FLEXION], 0.0), max(tau[ABDUCTION], 0.0)))
    return min(weakness.synergy * lifting, float(torque_max[ELBOW]))
