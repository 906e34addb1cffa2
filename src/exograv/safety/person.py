"""Limits for one person in one posture: torque around the plausible one, walls before the stops, an energy tank.

Sources of all figures: docs/explanation/safety.md.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from .limits import PersonLimits
from .plausible import GRAVITY_LEVEL_MAX

Numbers = list[float]

SHARE_MAX = 1.3
"""Largest torque as a multiple of the plausible torque [-]."""

WALL_AHEAD_S = 0.1
"""Time ahead for which a wall acts on the predicted joint position [s].

Torque needs this time to turn from pushing into braking. Without it, a joint of 2.7 rad/s went through the wall.
"""

MARGIN_NM = 3.0
"""Torque allowed beyond `SHARE_MAX` and friction [N·m]."""


def within(value: float, low: float, high: float) -> float:
    """Return the value, clipped to its bounds; the upper bound for NaN."""
    return value if low <= value <= high else low if value < low else high


@dataclass
class GuardedPerson:
    """Person in the machine now."""

    limits: PersonLimits
    gravity_level: float = 0.0
    """Felt share of the arm's weight, changed between ticks by guard or session (docs/explanation/safety.md)."""

    is_driven: bool = field(init=False, default=False)
    """True if control moves the arm along a path; set by `drive`."""

    energy_J: float = field(init=False)
    """Energy in the tank."""

    def __post_init__(self):
        limits, table = self.limits, self.limits.table
        self.energy_J, self._joints = limits.tank_start_J, range(len(limits.active_max_Nm))
        self._lower, self._upper = limits.q_lower.tolist(), limits.q_upper.tolist()
        active, free = limits.active_max_Nm, (limits.q_lower + limits.wall_rad, limits.q_upper - limits.wall_rad)
        rows = table.dry, table.viscous, table.error, active, np.minimum(MARGIN_NM, active), *free
        self._rows = list(zip(*(row.tolist() for row in rows), strict=True))
        """Limits of each joint that a tick reads, in this order."""
        self._friction, self._low, self._high = ([0.0] * len(self._rows) for _ in range(3))
        nowhere = [0.0] * len(self._rows)
        self.look(nowhere, nowhere)

    def look(self, q: Sequence[float], v: Sequence[float]) -> None:
        """Set the person's posture [rad] and velocity [rad/s], on which all later calls of this tick are based.

        Two rows of the envelope bound a joint. The first is 1.3 times the plausible torque and 3 N·m. The second is the
        plausible torque and the torque that a weak adult can resist.
        """
        # In this order a NaN level counts as 0. In the other order it would lift every bound.
        level = min(max(0.0, self.gravity_level), GRAVITY_LEVEL_MAX)
        carried, frictions, lows, highs = self.limits.table.torque(q, level), self._friction, self._low, self._high
        self._q, self._v, self._carried = q, v, carried
        self._priced = None
        """Torques whose excess over carrying is already computed in this tick."""
        self.is_in_a_wall = False
        """True if any joint is near one of its stops; walls act only there."""
        for j, (dry, viscous, error, active, least, free_lower, free_upper) in enumerate(self._rows):
            at, speed, p = q[j], v[j], carried[j]
            if not (free_lower <= at <= free_upper and free_lower <= at + WALL_AHEAD_S * speed <= free_upper):
                self.is_in_a_wall = True
            friction = frictions[j] = dry + viscous * abs(speed)
            size, beyond = abs(p), friction + error
            along, against = min(SHARE_MAX * size + MARGIN_NM, size + active) + beyond, least + beyond
            lows[j], highs[j] = (-against, along) if p > 0.0 else (-along, against)

    def drive(self, is_driven: bool) -> None:
        """Begin or end a motion in which control moves the arm along a path, against the person's own motion.

        At the begin the tank is filled to `driven_J`, and `driven_W` fills it as time passes. At the end the tank goes
        back to what a floating arm has at first.
        """
        if is_driven and not self.is_driven:
            self.energy_J = max(self.energy_J, self.limits.driven_J)
        elif not is_driven:
            self.energy_J = min(self.energy_J, self.limits.tank_start_J)
        self.is_driven = is_driven

    @property
    def is_past_a_stop(self) -> bool:
        """True if a joint is past its stop by more than `trip_rad`."""
        rows, trip = zip(self._lower, self._q, self._upper, strict=True), self.limits.trip_rad
        return not all(lower - trip <= q <= upper + trip for lower, q, upper in rows)

    def bounded(self, tau: Numbers) -> Numbers:
        """Torques [N·m] within the bounds of each joint; in a wall, torque towards the stop fades to carrying."""
        lows, highs = self._in_walls() if self.is_in_a_wall else (self._low, self._high)
        return [within(tau[j], lows[j], highs[j]) for j in self._joints]

    def braked(self, tau: Numbers, brakes: Numbers) -> Numbers:
        """Bounded torques minus braking torques [N·m], within the same rows; walls do not limit braking."""
        return [within(tau[j] - brakes[j], self._low[j], self._high[j]) for j in self._joints]

    def _in_walls(self) -> tuple[Numbers, Numbers]:
        """Bounds [N·m]; in a wall, the bound towards the stop fades to carrying."""
        lows, highs = self._low.copy(), self._high.copy()
        for j, p in enumerate(self._carried):
            into_upper, into_lower = self._depth(j)
            highs[j] -= into_upper * (highs[j] - max(p, lows[j]))
            lows[j] += into_lower * (min(p, highs[j]) - lows[j])
        return lows, highs

    def wall(self, joint: int, v: float) -> float:
        """Share of the damping that brakes a motion of `v` [rad/s] towards a stop [-]."""
        into_upper, into_lower = self._depth(joint)
        return into_upper if v > 0.0 else into_lower

    def afford(self, tau: Numbers, v: Sequence[float], rate: float) -> Numbers:
        """Return the torques, reduced to the power into the person that the tank can pay for.

        The excess a_j over carrying, at the speed v_j, can be taken back no faster than torque may change. Until it is
        gone it spends a_j² |v_j| / (2 rate). That much energy must be in the tank, so that the tank is empty only when
        no excess is left.

        Args:
            tau: Desired joint torques [N·m].
            v: Joint velocities [rad/s].
            rate: Largest torque rate [N·m/s].
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
        """Take the energy of the outgoing torque from the tank, or add the energy of braking."""
        refill, most = self.limits.path_W, self.limits.tank_max_J
        if self.is_driven:
            refill, most = max(refill, self.limits.driven_W), max(most, self.limits.driven_J)
        over, power = self._over(tau, v), -refill
        for j in self._joints:
            power += over[j] * v[j]
        self.energy_J = min(self.energy_J - dt * power, most)

    def _over(self, tau: Numbers, v: Sequence[float]) -> Numbers:
        """Torque beyond the plausible weight, and beyond friction in the direction of motion [N·m]."""
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
        """Depth in the walls before the upper and the lower stop, from 0 at the edge to 1 at the stop [-]."""
        at, wall = self._q[joint], self.limits.wall_rad
        least, most = sorted((at, at + WALL_AHEAD_S * self._v[joint]))
        into_upper = within((most - self._upper[joint]) / wall + 1.0, 0.0, 1.0)
        return into_upper, within((self._lower[joint] - least) / wall + 1.0, 0.0, 1.0)
