"""Model of where a finger lands: expected gravity, a slightly wrong sense of the arm's posture, and noise."""

from dataclasses import dataclass, field

import numpy as np
from jaxtyping import Float

from exograv.laboratory.participant.adaptation import Adaptation, AdaptationRates

from .arm_tables import ArmTables

PerFreedom = Float[np.ndarray, " arm"]


@dataclass(frozen=True)
class Character:
    """Constants of a participant, each with its source or standing."""

    stiffness: tuple[float, ...] = (40.0, 40.0, 40.0, 18.0)
    """Stiffness of shoulder and elbow in a reach [N·m/rad]; assumed: 20 to 60, and 10 to 25."""

    corrected: float = 0.85
    """Share of an open-loop error that is corrected on the way without sight [-]; assumed: 0.8 to 0.9."""

    bias_sd_deg: float = 0.8
    """Constant error of felt posture per joint, SD [°]. Source: 0.6 to 1.1°, van Beers et al. (1998)."""

    felt_sd_deg: float = 0.4
    """Error of felt posture from reach to reach, SD [°]; the split is assumed."""

    motor_noise: float = 0.03
    """Motor noise as a share of the held torque [-]; unverified."""

    level_sd: float = 0.03
    """Variation of the machine's left over from window to window, SD as a share of the arm's weight [-]; assumed."""

    aims: float = 0.2
    """Share of an error seen at the touch by which the next aim is corrected [-]; assumed."""

    seen_sd_mm: float = 2.0
    forgets_aim: float = 0.5
    """Share of the aim correction that is forgotten from window to window [-]; assumed."""

    interval_s: float = 2.75
    interval_sd: float = 0.06
    """Variation of the interval, SD as a share [-]; assumed."""

    hurries: float = 0.3
    """Share of an interval's error that an arrow corrects [-]; assumed."""

    rates: AdaptationRates = field(default_factory=AdaptationRates)


class Pointer:
    """Pointing of one person, from the first session to the flight."""

    def __init__(self, tables: ArmTables, seed: int, character: Character | None = None):
        """Begin with knowledge of the own arm on Earth."""
        self.character, self._tables = character or Character(), tables
        self._random = np.random.default_rng([seed, 41])
        n = len(tables.weight)
        self._bias = np.deg2rad(self.character.bias_sd_deg) * self._random.standard_normal(n)
        self._compliance = 1.0 / np.resize(self.character.stiffness, n)
        self.adaptation = Adaptation(self.character.rates, self._random)
        self._aim_mm, self._level = np.zeros(2), 1.0
        self._paces = 1.0 + 0.1 * float(self._random.standard_normal())
        """Own interval relative to the instructed one, before any arrow [-]."""

    def window(self, gravity_level: float) -> None:
        """Open a window at this level, which the machine does not produce exactly."""
        left_over = self.character.level_sd * float(self._random.standard_normal())
        self._level = gravity_level + left_over
        self._aim_mm *= 1.0 - self.character.forgets_aim
        self.adaptation.window(self._level)

    def reach(self) -> tuple[PerFreedom, Float[np.ndarray, " 2"]]:
        """Draw the next reach: posture change at the screen [rad], and the finger's error right and up [mm]."""
        own, draw = self.character, self._random.standard_normal
        tables, n = self._tables, len(self._tables.weight)
        torque = (self.adaptation.expected - self._level) * tables.weight
        noise = own.motor_noise * self.adaptation.expected * tables.weight * draw(n)
        off = (1.0 - own.corrected) * self._compliance * torque + self._compliance * noise
        off = off - self._bias + np.deg2rad(own.felt_sd_deg) * draw(n)
        landed_mm = 1e3 * tables.screen_slope @ off + self._aim_mm
        seen = landed_mm + own.seen_sd_mm * draw(2)
        self._aim_mm = self._aim_mm - own.aims * seen
        self.adaptation.learn(self.adaptation.expected - self._level)
        return off + tables.posture_change(1e-3 * self._aim_mm), landed_mm

    def interval(self) -> float:
        """Draw the time to the next touch [s]."""
        own = self.character
        return own.interval_s * self._paces * (1.0 + own.interval_sd * float(self._random.standard_normal()))

    def see_arrow(self, late_s: float) -> None:
        """Correct the pace after an arrow: the last touch was late, or (negative) early [s]."""
        self._paces -= self.character.hurries * late_s / self.character.interval_s
