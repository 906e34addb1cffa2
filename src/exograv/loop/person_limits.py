"""What may reach a person of these parameters, for the guard: made when they are accepted, between ticks."""

import numpy as np

from exograv.dynamics.machine import CalibratedMachine
from exograv.dynamics.parameters import Parameters
from exograv.model.assembly import Assembly
from exograv.safety.person import PersonLimits
from exograv.safety.plausible import PlausibleTable

from .plausible_table import TableMaker

ACTIVE_MAX_NM = {"shoulder": 8.0, "elbow": 4.0, "wrist": 1.0}
"""Beyond carrying and friction, what a weak adult can resist (docs/safety.md); the wrist's is assumed."""

STOPS_GIVE_RAD = np.deg2rad(8.0)
"""Past a stop, up to which it is no fault: a restless wearer with a kilogram in the hand went 5° past the twin's
(`exograv demo --rig recupera_like_qdd`, level 2, seed 0)."""


def person_limits(assembly: Assembly, machine: CalibratedMachine, x: Parameters) -> PersonLimits:
    """Table and walls of one person in one machine.

    Raises:
        ModelError: The arm lies in its cuffs in too few postures.
        ConfigError: The joints' limits leave no way between two walls.
    """
    return limits_of_table(assembly, TableMaker(assembly, machine, x).table(x))


def limits_of_table(assembly: Assembly, table: PlausibleTable) -> PersonLimits:
    """The same by a table that is there already."""
    lower, upper = np.array([(joint.lower, joint.upper) for joint in assembly.exo.joints]).T
    active = np.array([ACTIVE_MAX_NM[place] for place in assembly.description.places])
    return PersonLimits(table, active, lower, upper, trip_rad=float(STOPS_GIVE_RAD))
