"""What may reach a person of these parameters, for the guard: made once, when they are accepted."""

import numpy as np

from exograv.dynamics.machine import CalibratedMachine
from exograv.dynamics.parameters import Parameters
from exograv.model.assembly import Assembly
from exograv.safety.person import PersonLimits

from .plausible_table import plausible_table

ACTIVE_MAX_NM = {"shoulder": 8.0, "elbow": 4.0, "wrist": 1.0}
"""Beyond carrying and friction, what a weak adult can resist (docs/safety.md); the wrist's is assumed."""


def person_limits(assembly: Assembly, machine: CalibratedMachine, x: Parameters) -> PersonLimits:
    """Table and walls of one person in one machine.

    Raises:
        ModelError: The arm lies in its cuffs in too few postures.
        ConfigError: The joints' limits leave no way between two walls.
    """
    lower, upper = np.array([(joint.lower, joint.upper) for joint in assembly.exo.joints]).T
    active = np.array([ACTIVE_MAX_NM[place] for place in assembly.description.places])
    return PersonLimits(plausible_table(assembly, machine, x), active, lower, upper)
