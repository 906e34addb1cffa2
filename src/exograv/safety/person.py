"""Limits for one person in one posture: torque around the plausible one, walls before the stops, an energy tank.

`native/core.py` has the limits; this file gives them the person. Sources of all figures: docs/explanation/safety.md.
"""

from array import array

import numpy as np

from .limits import PersonLimits
from .native import core
from .record import NO_TABLE, GuardRecord, places

_SCALARS = [core.WORN, core.WALL, core.PAST_STOP, core.V_TRIP_PERSON, core.TANK_START, core.TANK_MAX, core.PATH_W]
_SCALARS += [core.DRIVEN_W, core.DRIVEN_J, core.POWER_MAX, core.LEVEL, core.DRIVEN, core.ENERGY, core.IN_WALL]
_FIELDS = [core.ACTIVE, core.LEAST_ACTIVE, core.LOWER, core.UPPER, core.FREE_LOWER, core.FREE_UPPER]
_FIELDS += [core.DRY, core.VISCOUS, core.ERROR, core.FRICTION, core.LOW, core.HIGH]
PLACES = np.array([*_SCALARS, *places(_FIELDS)])
"""Places of the record that belong to the person."""


class GuardedPerson:
    """Person in the machine now, or about to enter it."""

    def __init__(self, limits: PersonLimits, gravity_level: float = 0.0):
        """Describe a person who is in no machine yet.

        Args:
            limits: Limits of the person.
            gravity_level: Felt share of the arm's weight [-].
        """
        self.limits, joints = limits, len(limits.active_max_Nm)
        self._record = record = GuardRecord(joints, 0.0)
        self._table: array[float] = limits.table.packed()
        r = record.numbers
        r[core.WORN], r[core.WALL], r[core.PAST_STOP] = 1.0, limits.wall_rad, limits.trip_rad
        r[core.V_TRIP_PERSON] = limits.v_trip_rad_s
        r[core.TANK_START], r[core.TANK_MAX], r[core.ENERGY] = (
            limits.tank_start_J,
            limits.tank_max_J,
            limits.tank_start_J,
        )
        r[core.PATH_W], r[core.DRIVEN_W], r[core.DRIVEN_J] = limits.path_W, limits.driven_W, limits.driven_J
        r[core.POWER_MAX] = limits.power_max_W
        record.put(core.ACTIVE, limits.active_max_Nm)
        record.put(core.LEAST_ACTIVE, np.minimum(core.MARGIN_NM, limits.active_max_Nm))
        record.put(core.LOWER, limits.q_lower)
        record.put(core.UPPER, limits.q_upper)
        record.put(core.FREE_LOWER, limits.q_lower + limits.wall_rad)
        record.put(core.FREE_UPPER, limits.q_upper - limits.wall_rad)
        record.put(core.DRY, limits.table.dry)
        record.put(core.VISCOUS, limits.table.viscous)
        record.put(core.ERROR, limits.table.error)
        self.gravity_level = gravity_level
        core.look(r, self._table)

    def memory(self) -> tuple[int, int]:
        """Addresses of the record and the table of a person who is in no machine, for a loop in C."""
        return self._record.numbers.buffer_info()[0], self._table.buffer_info()[0]

    def enter(self, record: GuardRecord) -> None:
        """Enter a machine: from now on its guard keeps this person's state."""
        record.take(self._record, PLACES)
        record.bind(self._table)
        self._record = record

    def leave(self) -> None:
        """Leave the machine, and keep a state of one's own."""
        machine = self._record
        self._record = GuardRecord(machine.joints, 0.0)
        self._record.take(machine, PLACES)
        machine.numbers[core.WORN] = 0.0
        machine.bind(NO_TABLE)

    @property
    def gravity_level(self) -> float:
        """Felt share of the arm's weight, changed between ticks by guard or session (docs/explanation/safety.md).

        A session that sets it ends a ramp of the guard. Above 1 the guard needs the wearer's consent.
        """
        return self._record.numbers[core.LEVEL]

    @gravity_level.setter
    def gravity_level(self, level: float) -> None:
        r = self._record.numbers
        r[core.LEVEL] = r[core.LEVEL_WANTED] = level
        r[core.LEVEL_MOVES] = 0.0

    @property
    def is_driven(self) -> bool:
        """True if control moves the arm along a path; set by `drive`."""
        return self._record.numbers[core.DRIVEN] != 0.0

    @property
    def energy_J(self) -> float:
        """Energy in the tank [J]."""
        return self._record.numbers[core.ENERGY]

    @energy_J.setter
    def energy_J(self, energy: float) -> None:
        self._record.numbers[core.ENERGY] = energy

    @property
    def is_in_a_wall(self) -> bool:
        """True if any joint is near one of its stops; walls act only there."""
        return self._record.numbers[core.IN_WALL] != 0.0

    @property
    def is_past_a_stop(self) -> bool:
        """True if a joint is past its stop by more than `trip_rad`."""
        return core.is_past_a_stop(self._record.numbers)

    def look(self, q: list[float], v: list[float]) -> None:
        """Set the person's posture [rad] and velocity [rad/s], outside of a tick."""
        self._record.put(core.Q, np.array(q))
        self._record.put(core.KNOWN, np.array(v))
        core.look(self._record.numbers, self._table)

    def bounded(self, tau: list[float]) -> list[float]:
        """Torques [N·m] within the bounds of each joint; in a wall, torque towards the stop fades to carrying."""
        return [core.bounded(self._record.numbers, j, one) for j, one in enumerate(tau)]

    def drive(self, is_driven: bool) -> None:
        """Begin or end a motion in which control moves the arm along a path, against the person's own motion.

        At the begin the tank is filled to `driven_J`, and `driven_W` fills it as time passes. At the end the tank goes
        back to what a floating arm has at first.
        """
        core.drive(self._record.numbers, is_driven)
