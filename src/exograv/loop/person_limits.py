"""Guard limits for a wearer with given parameters. They are made between ticks, when the parameters are accepted."""

import numpy as np

from exograv.dynamics.machine import CalibratedMachine
from exograv.dynamics.parameters import Parameters
from exograv.model.assembly import Assembly
from exograv.safety.limits import PersonLimits
from exograv.safety.plausible import PlausibleTable

from .plausible_table import TableMaker

ACTIVE_MAX_NM = {"shoulder": 8.0, "elbow": 4.0, "wrist": 1.0}
"""Torque that a weak adult can resist, in addition to carrying and friction [N·m] (docs/explanation/safety.md). The
wrist's value is assumed."""

POWER_MAX_W = 10.0
"""Largest power into the person beyond carrying and friction (docs/explanation/safety.md)."""

STOPS_GIVE_RAD = np.deg2rad(8.0)
"""Angle past a joint stop that does not count as a fault [rad]. A restless wearer with 1 kg in the hand moved 5° past
the twin's stop (`exograv demo --rig recupera_like_qdd`, level 2, seed 0)."""


def person_limits(assembly: Assembly, machine: CalibratedMachine, x: Parameters) -> PersonLimits:
    """Table and walls of one wearer in one machine.

    Raises:
        ModelError: The arm lies in its cuffs in too few postures.
        ConfigError: The joints' limits leave no range between two walls.
    """
    return limits_of_table(assembly, TableMaker(assembly, machine, x).table(x))


def limits_of_table(assembly: Assembly, table: PlausibleTable) -> PersonLimits:
    """Table and walls as in `person_limits`, for a table that exists already."""
    lower, upper = np.array([(joint.lower, joint.upper) for joint in assembly.exo.joints]).T
    active = np.array([ACTIVE_MAX_NM[place] for place in assembly.description.places])
    return PersonLimits(table, active, lower, upper, trip_rad=float(STOPS_GIVE_RAD), power_max_W=POWER_MAX_W)
