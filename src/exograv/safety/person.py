"""What may reach this person in this posture: torque around the plausible one, walls before the joints' stops, a tank.

Sources of all figures: docs/safety.md.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from jaxtyping import Float

from exograv.errors import ConfigError

from .plausible import GRAVITY_LEVEL_MAX, PlausibleTable

Joints = Float[np.ndarray, " joint"]
Numbers = list[float]

SHARE_MAX = 1.3
"""Of the plausible torque [-]."""

MARGIN_NM = 3.0
"""Beyond that share and friction [N·m]."""


@dataclass(frozen=True)
class PersonLimits:
    """Of one person in one machine."""

    table: PlausibleTable

    active_max_Nm: Joints
    """Beyond plausible compensation and friction: what a weak adult can resist."""

    q_lower: Joints
    """Where the joints' stops are [rad]."""
    q_upper: Joints

    wall_rad: float = math.radians(10.0)
    """Before a stop, where the wall begins."""

    trip_rad: float = math.radians(2.0)
    """Past a stop, where something must be wrong."""

    tank_start_J: float = 0.5
    tank_max_J: float = 1.0
    """What control may put into the person beyond carrying; it fills again by braking only."""

    def __post_init__(self):
        if not (self.wall_rad > 0.0 and 0.0 <= self.trip_rad < math.inf):
            raise ConfigError(
                f"wall_rad is {self.wall_rad}, trip_rad {self.trip_rad}; allowed: above 0, and from 0 up. Correct them."
            )
        bad = np.flatnonzero(~(self.q_upper - self.q_lower > 2.0 * self.wall_rad))
        if bad.size:
            j = bad[0]
            raise ConfigError(
                f"Joint {j} moves from {self.q_lower[j]} to {self.q_upper[j]} rad: no way is left between two walls of "
                f"{self.wall_rad:.3f} rad. Correct the limits in the URDF."
            )
        if not (np.isfinite(self.active_max_Nm) & (self.active_max_Nm > 0.0)).all():
            raise ConfigError(f"active_max_Nm is {self.active_max_Nm}; it must be positive and finite. Correct it.")
        if not 0.0 < self.tank_start_J <= self.tank_max_J < math.inf:
            raise ConfigError(
                f"tank_start_J is {self.tank_start_J}; allowed: above 0 and up to tank_max_J, {self.tank_max_J}."
            )


@dataclass
class Person:
    """Who is in the machine now."""

    limits: PersonLimits
    gravity_level: float = 0.0
    """Felt share of the arm's weight; changed between ticks, by whoever may (docs/safety.md)."""

    energy_J: float = field(init=False)
    """In the tank."""

    def __post_init__(self):
        table = self.limits.table
        self.energy_J = self.limits.tank_start_J
        self._error, self._dry = table.error.tolist(), table.dry.tolist()
        self._viscous: Numbers = table.viscous.tolist()
        self._active: Numbers = self.limits.active_max_Nm.tolist()
        self._lower: Numbers = self.limits.q_lower.tolist()
        self._upper: Numbers = self.limits.q_upper.tolist()
        self._plausible: Numbers = [0.0] * len(self._active)
        self._friction: Numbers = [0.0] * len(self._active)

    def past_a_stop(self, q: Sequence[float]) -> bool:
        """Whether a joint is where it cannot be [rad]."""
        trip = self.limits.trip_rad
        return any(
            not low - trip <= at <= high + trip for at, low, high in zip(q, self._lower, self._upper, strict=True)
        )

    def look(self, q: Joints, v: Sequence[float]) -> None:
        """Where the person is now [rad], [rad/s]; all that follows in this tick is about this posture."""
        # In this order a level that is no number counts as 0; in the other it would lift every bound.
        level = min(max(0.0, self.gravity_level), GRAVITY_LEVEL_MAX)
        self._plausible = self.limits.table.torque(q, level).tolist()
        self._friction = [dry + slope * abs(w) for dry, slope, w in zip(self._dry, self._viscous, v, strict=True)]

    def allowed(self, joint: int, q: float) -> tuple[float, float]:
        """Least and greatest torque of a joint at `q` [rad] [N·m].

        Both rows of the envelope hold: 1.3 times the plausible torque and 3 N·m, and the plausible torque and what a
        weak adult can resist. Within a wall what pushes on towards the stop fades away.
        """
        p, active = self._plausible[joint], self._active[joint]
        beyond = self._friction[joint] + self._error[joint]
        low = max(SHARE_MAX * min(p, 0.0) - MARGIN_NM, min(p, 0.0) - active) - beyond
        high = min(SHARE_MAX * max(p, 0.0) + MARGIN_NM, max(p, 0.0) + active) + beyond
        into_upper, into_lower = self._depth(joint, q)
        if into_upper > 0.0:
            high -= into_upper * (high - max(p, low))
        if into_lower > 0.0:
            low += into_lower * (min(p, high) - low)
        return low, high

    def wall(self, joint: int, q: float, v: float) -> float:
        """Share of the damping with which a motion towards a stop is braked at `q` [rad], `v` [rad/s] [-]."""
        into_upper, into_lower = self._depth(joint, q)
        return into_upper if v > 0.0 else into_lower

    def afford(self, tau: Numbers, v: Sequence[float], rate: float) -> Numbers:
        """The same torques with as much power into the person as the tank can pay for.

        What is over carrying a_j at the speed v_j can be taken back no faster than torque may change, and until it is
        gone it spends a_j² |v_j| / (2 rate). That much must be in the tank, so that it is empty only when nothing is
        over.

        Args:
            tau: Wanted torque a joint [N·m].
            v: Velocities [rad/s].
            rate: How fast torque may change [N·m/s].
        """
        over = self._over(tau, v)
        needed = sum(a * a * abs(w) for a, w in zip(over, v, strict=True) if a * w > 0.0) / (2.0 * rate)
        has = max(self.energy_J, 0.0)
        if needed <= has:
            return tau
        kept = math.sqrt(has / needed)
        return [one - (1.0 - kept) * a if a * w > 0.0 else one for one, a, w in zip(tau, over, v, strict=True)]

    def pay(self, tau: Numbers, v: Sequence[float], dt: float) -> None:
        """Let the tank pay for what goes out, or fill by what brakes."""
        power = sum(a * w for a, w in zip(self._over(tau, v), v, strict=True))
        self.energy_J = min(self.energy_J - dt * power, self.limits.tank_max_J)

    def _over(self, tau: Numbers, v: Sequence[float]) -> Numbers:
        """What torques are over carrying the plausible weight and over friction in the joint's own direction."""
        return [one - self._passive(joint, one, v[joint]) for joint, one in enumerate(tau)]

    def _passive(self, joint: int, tau: float, v: float) -> float:
        """The part of a torque that carries, or overcomes friction."""
        p = self._plausible[joint]
        over = math.copysign(1.0, v) * (tau - p)
        return p + math.copysign(min(max(over, 0.0), self._friction[joint]), v)

    def _depth(self, joint: int, q: float) -> tuple[float, float]:
        """How far into the wall before the upper and the lower stop, 0 to 1 at the stop [-]."""
        wall = self.limits.wall_rad
        return _share((q - self._upper[joint]) / wall + 1.0), _share((self._lower[joint] - q) / wall + 1.0)


def _share(value: float) -> float:
    return min(max(value, 0.0), 1.0)
