"""What may reach this person in this posture: torque around the plausible one, walls before the joints' stops, a tank.

Sources of all figures: docs/safety.md.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from exograv.errors import ConfigError
from exograv.signals import Joints

from .plausible import GRAVITY_LEVEL_MAX, PlausibleTable

Numbers = list[float]

SHARE_MAX = 1.3
"""Of the plausible torque [-]."""

WALL_AHEAD_S = 0.1
"""A wall is felt where a joint will be so soon: torque that pushes on needs so long to become torque that brakes, and
a joint of 2.7 rad/s went through the wall meanwhile [s]."""

MARGIN_NM = 3.0
"""Beyond that share and friction [N·m]."""


def within(value: float, low: float, high: float) -> float:
    """The value, or the bound that it is beyond; the upper one for what is no number."""
    return value if low <= value <= high else low if value < low else high


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

    v_trip_rad_s: float = math.inf
    """Speed at which the soft descent starts, where that is sooner than the machine's own."""

    tank_start_J: float = 0.5
    tank_max_J: float = 1.0
    """What control may put into the person beyond carrying; it fills again by braking, and by `path_W`."""

    path_W: float = 0.0
    driven_W: float = 0.0
    driven_J: float = 0.0
    """What a motion on a path takes beyond carrying, while the arm is moved along one."""

    def __post_init__(self):
        not_negative = ("trip_rad", "path_W", "driven_W", "driven_J")
        most_J, is_active = self.tank_max_J, (self.active_max_Nm > 0.0) & np.isfinite(self.active_max_Nm)
        for name, is_allowed, allowed in (
            ("wall_rad", self.wall_rad > 0.0, "above 0"),
            ("active_max_Nm", is_active.all(), "above 0, finite"),
            ("v_trip_rad_s", self.v_trip_rad_s > 0.0, "above 0"),
            *((name, 0.0 <= getattr(self, name) < math.inf, "0 and above, finite") for name in not_negative),
            ("tank_start_J", 0.0 < self.tank_start_J <= most_J < math.inf, f"above 0 and up to tank_max_J, {most_J}"),
        ):
            if not is_allowed:
                raise ConfigError(f"{name} is {getattr(self, name)}; allowed: {allowed}. Correct it.")
        for j, (lower, upper) in enumerate(zip(self.q_lower, self.q_upper, strict=True)):
            if not upper - lower > 2.0 * self.wall_rad:
                raise ConfigError(
                    f"Joint {j} moves from {lower} to {upper} rad: no way is left between two walls of "
                    f"{self.wall_rad:.3f} rad. Correct the limits in the URDF."
                )


@dataclass
class Person:
    """Who is in the machine now."""

    limits: PersonLimits
    gravity_level: float = 0.0
    """Felt share of the arm's weight; changed between ticks, by whoever may (docs/safety.md)."""

    is_driven: bool = field(init=False, default=False)
    """Whether control moves the arm along a path, as `drive` was told."""

    energy_J: float = field(init=False)
    """In the tank."""

    def __post_init__(self):
        limits, table = self.limits, self.limits.table
        self.energy_J, self._joints = limits.tank_start_J, range(len(limits.active_max_Nm))
        self._lower, self._upper = limits.q_lower.tolist(), limits.q_upper.tolist()
        active, free = limits.active_max_Nm, (limits.q_lower + limits.wall_rad, limits.q_upper - limits.wall_rad)
        rows = table.dry, table.viscous, table.error, active, np.minimum(MARGIN_NM, active), *free
        self._rows = list(zip(*(row.tolist() for row in rows), strict=True))
        """What a tick asks of each joint, in this order."""
        still = [0.0] * len(self._joints)
        self._friction, self._low, self._high = still.copy(), still.copy(), still.copy()
        self.look(still, still)

    def look(self, q: Sequence[float], v: Sequence[float]) -> None:
        """Where the person is now [rad], [rad/s]; all that follows in this tick is about this posture.

        Both rows of the envelope bound a joint: 1.3 times the plausible torque and 3 N·m, and the plausible torque and
        what a weak adult can resist.
        """
        # In this order a level that is no number counts as 0; in the other it would lift every bound.
        level = min(max(0.0, self.gravity_level), GRAVITY_LEVEL_MAX)
        self._q, self._v, self._carried = q, v, self.limits.table.torque(q, level)
        self.is_in_a_wall = False
        """Whether any joint is near one of its stops; there alone walls have anything to say."""
        for j, (dry, viscous, error, active, least, free_lower, free_upper) in enumerate(self._rows):
            at, speed, p = q[j], v[j], self._carried[j]
            if not (free_lower <= at <= free_upper and free_lower <= at + WALL_AHEAD_S * speed <= free_upper):
                self.is_in_a_wall = True
            friction = self._friction[j] = dry + viscous * abs(speed)
            size, beyond = abs(p), friction + error
            along, against = min(SHARE_MAX * size + MARGIN_NM, size + active) + beyond, least + beyond
            self._low[j], self._high[j] = (-against, along) if p > 0.0 else (-along, against)

    def drive(self, is_driven: bool) -> None:
        """From here on control moves the arm along a path, against whatever its wearer does; or lets it go.

        The tank is then filled to `driven_J`, and by `driven_W` as time passes; who is let go has what a floating arm
        has at first.
        """
        if is_driven and not self.is_driven:
            self.energy_J = max(self.energy_J, self.limits.driven_J)
        elif not is_driven:
            self.energy_J = min(self.energy_J, self.limits.tank_start_J)
        self.is_driven = is_driven

    @property
    def is_past_a_stop(self) -> bool:
        """Whether a joint is where it cannot be."""
        rows, trip = zip(self._lower, self._q, self._upper, strict=True), self.limits.trip_rad
        return self.is_in_a_wall and not all(lower - trip <= q <= upper + trip for lower, q, upper in rows)

    def bounded(self, tau: Numbers) -> Numbers:
        """Torques [N·m] within what each joint may be told; what pushes on in a wall fades to carrying."""
        found = list(tau)
        for j in self._joints:
            low, high = self._in_wall(j) if self.is_in_a_wall else (self._low[j], self._high[j])
            if not low <= found[j] <= high:
                found[j] = within(found[j], low, high)
        return found

    def braked(self, tau: Numbers, brakes: Numbers) -> Numbers:
        """Bounded torques less what brakes [N·m]: within the same rows, but no wall takes from what brakes."""
        return [within(tau[j] - brakes[j], self._low[j], self._high[j]) for j in self._joints]

    def _in_wall(self, joint: int) -> tuple[float, float]:
        """What pushes on towards a stop fades to carrying [N·m]."""
        low, high, p = self._low[joint], self._high[joint], self._carried[joint]
        into_upper, into_lower = self._depth(joint)
        high -= into_upper * (high - max(p, low))
        low += into_lower * (min(p, high) - low)
        return low, high

    def wall(self, joint: int, v: float) -> float:
        """Share of the damping with which a motion of `v` [rad/s] towards a stop is braked [-]."""
        into_upper, into_lower = self._depth(joint)
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
        over, needed = self._over(tau, v), 0.0
        for j in self._joints:
            if over[j] * v[j] > 0.0:
                needed += over[j] * over[j] * abs(v[j])
        needed /= 2.0 * rate
        has = max(self.energy_J, 0.0)
        if needed <= has:
            return tau
        lost = 1.0 - math.sqrt(has / needed)
        return [tau[j] - lost * over[j] if over[j] * v[j] > 0.0 else tau[j] for j in self._joints]

    def pay(self, tau: Numbers, v: Sequence[float], dt: float) -> None:
        """Let the tank pay for what goes out, or fill by what brakes."""
        limits = self.limits
        refill, most = limits.path_W, limits.tank_max_J
        if self.is_driven:
            refill, most = max(refill, limits.driven_W), max(most, limits.driven_J)
        over, power = self._over(tau, v), -refill
        for j in self._joints:
            power += over[j] * v[j]
        self.energy_J = min(self.energy_J - dt * power, most)

    def _over(self, tau: Numbers, v: Sequence[float]) -> Numbers:
        """What torques are over carrying the plausible weight and over friction in the joint's own direction."""
        found = list(tau)
        for j in self._joints:
            over, friction = tau[j] - self._carried[j], self._friction[j]
            if over * v[j] > 0.0:
                over = over - friction if over > friction else over + friction if over < -friction else 0.0
            found[j] = over
        return found

    def _depth(self, joint: int) -> tuple[float, float]:
        """How far into the wall before the upper and the lower stop, 0 to 1 at the stop [-]."""
        at, wall = self._q[joint], self.limits.wall_rad
        least, most = sorted((at, at + WALL_AHEAD_S * self._v[joint]))
        into_upper = within((most - self._upper[joint]) / wall + 1.0, 0.0, 1.0)
        return into_upper, within((self._lower[joint] - least) / wall + 1.0, 0.0, 1.0)
