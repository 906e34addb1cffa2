"""Constants of a virtual participant, with unit, status, source and the range of their sweep."""

from collections.abc import Mapping
from dataclasses import dataclass, field, fields, is_dataclass, replace
from typing import Any

import numpy as np

from exograv.errors import ConfigError
from exograv.laboratory.movements import REACH_S
from exograv.rig.twin.behaviour.acting_wearer import Nerves
from exograv.rig.twin.disturbances.constant import Constant, constant, constants_of

from .adaptation import AdaptationRates

MOST = {
    "trusts_felt": 0.99,  # At 1 vision would not change the expectation. Learning divides by the rest.
    "mass_doubt": 0.99,  # A share of the inertia must remain.
    "reflex_share": 0.99,  # At 1 the delay makes the reflex unstable.
    **dict.fromkeys(("fast_keeps", "slow_keeps", "night_keeps", "keeps_aim"), 1.0),  # A retained state does not grow.
}
"""Largest value of a constant with an upper limit [-]."""

DIVIDES = ("width", "stiffness_share", "tension")
"""Constants that are divisors."""


@dataclass(frozen=True)
class Habits:
    """Constants of one participant."""

    bias_sd_deg: float = constant(
        0.8, "°", "source", "0.6–1.1°, van Beers et al. (1998); personal maps are stable (PMC3217916)", 0.6, 1.1
    )
    """Standard deviation of the personal map's error per joint: felt posture of an unseen arm minus the true one."""

    felt_sd_deg: float = constant(0.4, "°", "assumed", "the part of it that does not last", 0.2, 0.8)
    """Standard deviation of the part of this error that changes from reach to reach."""

    felt_s: float = constant(2.0, "s", "assumed", "about a reach", 0.5, 10.0)
    """Correlation time of that part."""

    motor_noise: float = constant(
        0.03, "-", "unverified", "1.5–4 % for proximal joints; it grows with torque: Hamilton et al. (2004)", 0.015, 0.1
    )  # fmt: skip
    """Share of a muscle's torque, standard deviation."""

    motor_noise_s: float = constant(0.2, "s", "assumed", "several times a muscle's lag", 0.05, 0.5)
    """Correlation time of this noise."""

    trusts_felt: float = constant(
        0.9,
        "-",
        "fitted",
        "first error without weight 1–3 cm, unverified (docs/explanation/virtual_participant.md)",
        0.7,
        0.95,
    )
    """Share of a wrong expectation of the own weight that the felt arm corrects, before the reach and on the way."""

    mass_doubt: float = constant(
        0.3, "-", "source", "slower, earlier-peaked reaches in space fit a mass underestimated by 30 %, eLife RP107472",
        0.0, 0.5,
    )  # fmt: skip
    """Share of the own inertia that is not anticipated when the arm feels weightless."""

    knows_machine: float = constant(1.0, "-", "assumed", "a machine is worn for minutes before", 0.0, 1.0)
    """Share of the worn machine's inertia that is anticipated."""

    sees_higher_m: float = constant(
        0.0, "m", "assumed", "none: Chen et al. and Bock (1996) have the direction, no size for a target that is seen "
        "was found", 0.0, 0.08,
    )  # fmt: skip
    """Shift of the perceived target upwards for each g of gravity at the head beyond Earth's (elevator illusion)."""

    rates: AdaptationRates = field(default_factory=AdaptationRates)
    """Rates of learning about the own weight, from seen deviations."""

    nerves: Nerves = field(default_factory=Nerves)

    stiffness_share: float = constant(1.0, "-", "unverified", "of the stiffness in `USUAL` (Gomi & Osu 1998)", 0.5, 1.5)
    damping_share: float = constant(1.0, "-", "unverified", "of the damping in `USUAL`", 0.5, 1.5)
    strength_share: float = constant(1.0, "-", "unverified", "of the strength in `USUAL`", 0.5, 1.3)

    tension: float = constant(
        2.0,
        "-",
        "assumed",
        "a shoulder then has 40 N·m/rad, between the 20 and 60 of the project's generator",
        1.0,
        3.0,
    )
    """Stiffness relative to that of a usual reach, from co-contraction for a small target."""

    learns_aim: float = constant(
        0.1, "-", "fitted", "halved for a half-life at 0 g of 3 to 8 movements, unverified; it stays below", 0.0, 0.4
    )
    """Share of a deviation that the next aim corrects, independent of its cause."""

    keeps_aim: float = constant(0.5, "-", "assumed", "no value was found; with 1 nothing is ever forgotten", 0.0, 1.0)
    """Share of this correction of the aim that remains after a rest."""

    seen_sd_m: float = constant(0.002, "m", "assumed", "the finger appears only just before contact", 0.0, 0.01)
    """Standard deviation of a seen deviation."""

    effort_s: float = constant(0.3, "s", "assumed", "short against a window", 0.1, 0.6)
    """Time over which the own effort is felt."""

    reach_s: float = constant(REACH_S, "s", "assumed", "an unhurried reach at the paper's pace", 0.7, 1.1)
    """Duration of a reach to the screen, and of the return."""

    interval_s: float = constant(2.75, "s", "source", "the paper: 8 touches in 22 s", 2.75, 2.75)
    """Time from touch to touch, as instructed."""

    interval_sd: float = constant(0.04, "-", "assumed", "a pace that is kept by feeling", 0.02, 0.08)
    """Standard deviation of an interval, as a share of it."""

    hurries: float = constant(0.1, "-", "assumed", "a few arrows to a pace", 0.0, 0.2)
    """Share by which an arrow changes the own interval."""

    reaction_s: float = constant(0.35, "s", "assumed", "to a target that is expected", 0.2, 0.5)
    touch_s: float = constant(0.2, "s", "assumed", "a tap", 0.1, 0.4)
    """Time for which the finger stays on the screen."""

    depth_m: float = constant(0.02, "m", "assumed", "a finger that means to arrive", 0.01, 0.04)
    """Depth of the aim behind the glass. It grows after a reach that met nothing."""

    approach_m: float = constant(0.12, "m", "assumed", "nobody slides along a screen", 0.06, 0.2)
    """Distance before the glass at which the path bends towards it."""

    lift_m: float = constant(0.03, "m", "assumed", "clear of the lap by more than an arm is felt wrongly", 0.02, 0.05)
    """Height of the hand above its support while the arm is held."""

    full_s: float = constant(1.0, "s", "assumed", "unhurried", 0.5, 1.5)
    """Duration of the change from relaxed to tense, and back."""

    ready_s: float = constant(2.5, "s", "assumed", "with the last counts of the countdown", 1.5, 4.0)
    """Time before a window at which the person starts to hold the arm."""


def register(habits: Habits | None = None) -> list[Constant]:
    """List every constant of a virtual participant."""
    return list(constants_of(habits or Habits()))


def swept() -> list[Constant]:
    """List the constants over which results are swept: all that the instruction does not fix."""
    return [one for one in register() if one.low < one.high]


def with_constant(habits: Habits, name: str, value: float) -> Habits:
    """Return the person with one constant changed, in whichever class it is.

    Raises:
        ConfigError: There is no such constant, or the value is outside its limits.
    """
    known = {one.name: one for one in register()}
    if name not in known:
        raise ConfigError(
            f"A virtual participant has no constant '{name}'. The constants are {', '.join(sorted(known))}."
        )
    one = known[name]
    least_is_out, most = one.unit == "s" or name in DIVIDES, MOST.get(name, np.inf)
    if not (value > 0.0 if least_is_out else value >= 0.0) or not value <= most:
        allowed = f"{'above' if least_is_out else 'from'} 0" + (f" to {most:g}" if most < np.inf else "")
        plausible = f"{one.low:g} to {one.high:g} are plausible" if one.low < one.high else f"{one.value:g} is usual"
        raise ConfigError(f"Constant {name} is {value:g}; allowed: {allowed}. Give another value: {plausible}.")
    return _with(habits, name, value)


def with_constants(constants: Mapping[str, float]) -> Habits:
    """Return the usual person with these constants changed.

    Raises:
        ConfigError: As `with_constant`, or a value is not a finite number.
    """
    habits, known = Habits(), {one.name: one for one in register()}
    for name, value in constants.items():
        if name in known and not np.isfinite(value):
            raise ConfigError(f"--constant {name} is {value}; give a finite number, such as {known[name].value:g}.")
        habits = with_constant(habits, name, value)
    return habits


def _with(settings: Any, name: str, value: float) -> Any:
    """Replace a value in nested dataclasses, whose fields all have different names."""
    for one in fields(settings):
        inner = getattr(settings, one.name)
        if one.name == name:
            return replace(settings, **{name: value})
        if is_dataclass(inner) and any(constant.name == name for constant in constants_of(inner)):
            return replace(settings, **{one.name: _with(inner, name, value)})
    return settings
