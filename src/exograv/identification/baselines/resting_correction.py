"""Correction of the table by the cuff torque at rest; shared by the methods `full` and `equilibrium`.

φ̂ = φ_table + gain(Y) · (τ_cuffs − Y φ_table),   τ and Y stacked over the rests
"""

from collections.abc import Callable, Sequence
from functools import cached_property

import numpy as np
from jaxtyping import Float

from exograv.dynamics.machine import CalibratedMachine
from exograv.dynamics.parameters import ParameterLayout, table_parameters
from exograv.errors import ConfigError
from exograv.identification.core.interface import Estimate, Parameters, Rest, Sample
from exograv.model.assembly import Assembly
from exograv.model.tree import inertia_about_origin, inertial_parameters

from .rest_choice import GainOf, best_rests
from .rest_statics import RestStatics

MASS_MIN = 0.2
"""Smallest mass of a segment over the table's [-]; forces at a cuff may look like a negative weight."""

Phi = Float[np.ndarray, " 10"]


class RestingCorrection:
    """Method that corrects the table once, from rests (a `RestingMethod`); it states no uncertainty."""

    def __init__(
        self,
        name: str,
        statics: RestStatics,
        gain_of: GainOf,
        possible: Callable[[Phi, Phi], Phi],
        rests_needed: int,
    ):
        """Take the parts of a method; `possible` makes a body of the corrected and the table's parameters."""
        self.name, self.rests_needed = name, rests_needed
        self._statics, self._gain_of, self._possible = statics, gain_of, possible
        self._layout = ParameterLayout.of(statics.assembly)
        self._table, self._t = table_arm(statics.assembly, statics.machine), 0.0
        self._x = self._table.copy()
        self.rest_s = 0.0
        """Total duration of the rests [s]."""

    @cached_property
    def postures(self) -> Float[np.ndarray, "rest joint"]:
        """Postures in which the arm must rest [rad]."""
        return best_rests(self._statics, self._gain_of, self.rests_needed)

    def take_rests(self, rests: Sequence[Rest]) -> None:
        """Correct the table by these rests; they replace rests of an earlier call.

        Raises:
            ConfigError: The number of rests is not `rests_needed`.
        """
        if len(rests) != self.rests_needed:
            raise ConfigError(
                f"{len(rests)} rests were given to method '{self.name}'; it needs {self.rests_needed}: one in each of "
                "its `postures`."
            )
        balances = [self._statics.balance(rest) for rest in rests]
        Y, tau = np.vstack([b.Y for b in balances]), np.concatenate([b.tau for b in balances])
        table = self._table[self._layout.phi]
        corrected = table + self._gain_of(Y) @ (tau - Y @ table)
        for body in self._layout.bodies:
            self._x[body] = self._possible(corrected[body], table[body])
        self.rest_s = sum(rest.seconds for rest in rests)

    def update(self, sample: Sample) -> None:
        """Advance the clock; the sample is not used."""
        self._t = sample.t

    def estimate(self) -> Estimate:
        """Return the corrected table; the table itself before the rests."""
        return Estimate(self._t, self._x.copy(), None, 0.0, 1.0)


def table_arm(assembly: Assembly, machine: CalibratedMachine) -> Parameters:
    """Parameters of the table's arm, without passive torque and aligned, in the calibrated machine."""
    coulomb, viscous = np.asarray(machine.friction.coulomb), np.asarray(machine.friction.viscous)
    return table_parameters(assembly.arm, machine.rotor_inertia, coulomb, viscous)


def measured_body(corrected: Phi, table: Phi) -> Phi:
    """Body (10,) with measured mass and centre; its inertia about the centre is the table's, scaled by the mass."""
    mass = max(float(corrected[0]), MASS_MIN * float(table[0]))
    com = table[1:4] / table[0]
    about_centre = inertia_about_origin(table) - table[0] * (com @ com * np.eye(3) - np.outer(com, com))
    return inertial_parameters(mass, corrected[1:4] / mass, mass / table[0] * about_centre)


def scaled_body(corrected: Phi, table: Phi) -> Phi:
    """Table's body (10,), scaled to the corrected mass."""
    return max(float(corrected[0] / table[0]), MASS_MIN) * table
