"""What may reach this person in this posture: torque around the plausible one, walls before the joints' stops, a tank.

Sources of all figures: docs/safety.md.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from .limits import PersonLimits
from .plausible import GRAVITY_LEVEL_MAX

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


@dataclass
class GuardedPerson:
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
        self._friction, self._low, self._high = ([0.0] * len(self._rows) for _ in range(3))
        nowhere = [0.0] * len(self._rows)
        self.look(nowhere, nowhere)

    def look(self, q: Sequence[float], v: Sequence[float]) -> None:
        """Where the person is now [rad], [rad/s]; all that follows in this tick is about this posture.

        Both rows of the envelope bound a joint: 1.3 times the plausible torque and 3 N·m, and the plausible torque and
        what a weak adult can resist.
        """
        # In this order a level that is no number counts as 0; in the other it would lift every bound.
        level = min(max(0.0, self.gravity_level), GRAVITY_LEVEL_MAX)
        carried, frictions, lows, highs = self.limits.table.torque(q, level), self._friction, self._low, self._high
        self._q, self._v, self._carried = q, v, carried
        self._priced = None
        """Torques of which it is known in this tick what they are over carrying."""
        self.is_in_a_wall = False
        """Whether any joint is near one of its stops; there alone walls have anything to say."""
        for j, (dry, viscous, error, active, least, free_lower, free_upper) in enumerate(self._rows):
            at, speed, p = q[j], v[j], carried[j]
            if not (free_lower <= at <= free_upper and free_lower <= at + WALL_AHEAD_S * speed <= free_upper):
                self.is_in_a_wall = True
            friction = frictions[j] = dry + viscous * abs(speed)
            size, beyond = abs(p), friction + error
            along, against = min(SHARE_MAX * size + MARGIN_NM, size + active) + beyond, least + beyond
            lows[j], highs[j] = (-against, along) if p > 0.0 else (-along, against)

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
        return not all(lower - trip <= q <= upper + trip for lower, q, upper in rows)

    def bounded(self, tau: Numbers) -> Numbers:
        """Torques [N·m] within what each joint may be told; what pushes on in a wall fades to carrying."""
        lows, highs = self._in_walls() if self.is_in_a_wall else (self._low, self._high)
        return [within(tau[j], lows[j], highs[j]) for j in self._joints]

    def braked(self, tau: Numbers, brakes: Numbers) -> Numbers:
        """Bounded torques less what brakes [N·m]: within the same rows, but no wall takes from what brakes."""
        return [within(tau[j] - brakes[j], self._low[j], self._high[j]) for j in self._joints]

    def _in_walls(self) -> tuple[Numbers, Numbers]:
        """Bounds [N·m], where what pushes on towards a stop fades to carrying."""
        lows, highs = self._low.copy(), self._high.copy()
        for j, p in enumerate(self._carried):
            into_upper, into_lower = self._depth(j)
            highs[j] -= into_upper * (highs[j] - max(p, lows[j]))
            lows[j] += into_lower * (min(p, highs[j]) - lows[j])
        return lows, highs

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
        refill, most = self.limits.path_W, self.limits.tank_max_J
        if self.is_driven:
            refill, most = max(refill, self.limits.driven_W), max(most, self.limits.driven_J)
        over, power = self._over(tau, v), -refill
        for j in self._joints:
            power += over[j] * v[j]
        self.energy_J = min(self.energy_J - dt * power, most)

    def _over(self, tau: Numbers, v: Sequence[float]) -> Numbers:
        """What torques are over carrying the plausible weight and over friction in the joint's own direction."""
        if tau == self._priced:
            return self._found
        carried, found = self._carried, list(tau)
        for j in self._joints:
            over = tau[j] - carried[j]
            if over * v[j] > 0.0:
                friction = self._friction[j]
                over = over - friction if over > friction else over + friction if over < -friction else 0.0
            found[j] = over
        self._priced, self._found = tau, found
        return found

    def _depth(self, joint: int) -> tuple[float, float]:
        """How far into the wall before the upper and the lower stop, 0 to 1 at the stop [-]."""
        at, wall = self._q[joint], self.limits.wall_rad
        least, most = sorted((at, at + WALL_AHEAD_S * self._v[joint]))
        into_upper = within((most - self._upper[joint]) / wall + 1.0, 0.0, 1.0)
        return into_upper, within((self._lower[joint] - least) / wall + 1.0, 0.0, 1.0)
