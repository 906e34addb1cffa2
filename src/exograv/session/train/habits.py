"""What makes one virtual participant: constants, each with its source or called assumed."""

from dataclasses import dataclass, field

from .adapting import Rates


@dataclass(frozen=True)
class Habits:
    """What makes one participant."""

    bias_sd_deg: float = 0.8
    """Of the personal map, joint by joint: where an unseen arm is felt. Source: 0.6–1.1°, van Beers et al. (1998);
    personal maps are stable (docs/train.md)."""

    felt_sd_deg: float = 0.4
    """The same from reach to reach."""

    felt_s: float = 2.0
    """How long such an error lasts."""

    motor_noise: float = 0.03
    """Share of a muscle's torque, standard deviation."""

    motor_noise_s: float = 0.2
    """How long it lasts."""

    trusts_felt: float = 0.7
    """Share of a wrong expectation of the own weight that is put right by what the arm feels like before it reaches;
    with what is corrected on the way 0.8 to 0.9 of an error (docs/train.md)."""

    rates: Rates = field(default_factory=Rates)
    """Of what is learned about the own weight, from deviations that are seen."""

    learns_aim: float = 0.2
    """Share of a deviation that is aimed away next time, whatever explains it."""

    seen_sd_m: float = 0.002
    """How exactly it is seen: the finger appears only just before contact."""

    interval_s: float = 2.75
    """From touch to touch, as instructed."""

    interval_sd: float = 0.04
    """Share by which an interval is missed."""

    hurries: float = 0.1
    """Share of the interval by which an arrow changes the own pace."""

    tension: float = 2.0
    """Stiffness over that of a usual reach, of antagonists that are tensed together for a small target [-]. With it a
    shoulder has 40 N·m/rad, between the 20 and 60 of docs/train.md."""

    reaction_s: float = 0.35
    touch_s: float = 0.2
    """For which the finger stays on the screen."""

    depth_m: float = 0.02
    """Beyond the glass to where the reach is aimed; farther after a reach that met nothing."""
