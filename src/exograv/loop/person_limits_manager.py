"""Who the guard takes to be in the machine, phase by phase; every table is made between two ticks, never in one."""

from dataclasses import replace

import numpy as np
from jaxtyping import Float

from exograv.dynamics.machine import CalibratedMachine
from exograv.dynamics.parameters import ParameterLayout, Parameters
from exograv.model.arm import WeightPlace, held_weight
from exograv.model.assembly import Assembly
from exograv.model.support import sample_postures
from exograv.options import HEAVIEST_KG
from exograv.safety.envelope import Envelope
from exograv.safety.person import GuardedPerson, PersonLimits

from .person_limits import limits_of_table
from .plausible_table import TableMaker

POSTURES = 64
"""Of the task workspace, at which it is asked how far off an arm may be."""

V_MORE_RAD_S = 1.0
"""Than the motion itself, while the arm or a weight is not known (docs/safety.md)."""

UNKNOWN_J = 3.0
"""In the tank while the arm is not known, beside what the unknown torque takes over half of the workspace."""

PATH_W = 2.0
"""Allowed along a path beyond carrying: damping of the arm's joints, hysteresis and what the table's arm is off took
0.4 W on a tuning wearer (recupera_like, level 2, seed 1000)."""

Joints = Float[np.ndarray, " joint"]
Covariance = Float[np.ndarray, "parameter parameter"]


class LimitsMaker:
    """What the guard is to hold one wearer in one machine to, by what is known of the arm."""

    def __init__(self, assembly: Assembly, machine: CalibratedMachine, x: Parameters):
        """Prepare; seconds pass.

        Args:
            assembly: The machine with the arm in it.
            machine: As calibrated.
            x: Of the table's arm or of this one.
        """
        self._assembly, self._maker = assembly, TableMaker(assembly, machine, x)
        self._workspace = sample_postures(assembly.description, POSTURES)
        self._layout = ParameterLayout.of(assembly)

    def expected(self, x: Parameters, covariance: Covariance, v_motion: float) -> PersonLimits:
        """Of somebody who may be anyone that is believed possible; moved by up to `v_motion` [rad/s]."""
        margin = self._maker.margin(x, covariance, self._workspace)
        return self._unsure(x, np.zeros(self._layout.phi.stop), margin, v_motion)

    def known(self, x: Parameters, payload: Float[np.ndarray, " phi"] | None = None) -> PersonLimits:
        """Of somebody who has been identified, with what is carried besides the arm."""
        return _driven(limits_of_table(self._assembly, self._maker.table(x, payload)))

    def weighed(self, x: Parameters, place: WeightPlace, v_motion: float) -> PersonLimits:
        """The same with anything up to `HEAVIEST_KG` at a place: nowhere else a payload is plausible."""
        half = held_weight(self._assembly.arm, 0.5 * HEAVIEST_KG, at=place)
        loaded, q = x.copy(), self._workspace
        loaded[self._layout.phi] += half
        both = np.vstack([np.tile(x, (len(q), 1)), np.tile(loaded, (len(q), 1))])
        z = np.tile(self._maker.resting.cold_start(q, x), (2, 1))
        found = self._maker.resting(np.tile(q, (2, 1)), both, z)
        without, with_half = found.tau_desired.reshape(2, len(q), -1)
        usable = found.is_closed.reshape(2, len(q)).all(axis=0)
        margin = np.abs(with_half - without)[usable].max(axis=0)
        return self._unsure(x, half, margin, v_motion)

    def _unsure(
        self, x: Parameters, payload: Float[np.ndarray, " phi"], margin: Joints, v_motion: float
    ) -> PersonLimits:
        """Limits of an arm of which a torque of `margin` [N·m] is not known."""
        lower, upper = self._assembly.description.workspace
        table = self._maker.table(x, payload, margin)
        tank_J = UNKNOWN_J + float(0.5 * margin @ (upper - lower))
        limits = replace(
            limits_of_table(self._assembly, table),
            v_trip_rad_s=v_motion + V_MORE_RAD_S,
            tank_start_J=tank_J,
            tank_max_J=tank_J,
            path_W=PATH_W,
        )
        return _driven(limits)


def _driven(limits: PersonLimits) -> PersonLimits:
    """With what there is besides while control moves the arm along a path."""
    return replace(limits, driven_W=PATH_W, driven_J=UNKNOWN_J)


class PersonLimitsManager:
    """Tells an envelope, phase by phase, who is in the machine."""

    def __init__(self, envelope: Envelope, assembly: Assembly, machine: CalibratedMachine, x: Parameters):
        """Prepare, as `LimitsMaker`; seconds pass."""
        self._envelope, self._maker = envelope, LimitsMaker(assembly, machine, x)

    def expect(self, x: Parameters, covariance: Covariance, v_motion: float) -> None:
        """Somebody who may be anyone that is believed possible; moved by up to `v_motion` [rad/s]."""
        self._put_in(self._maker.expected(x, covariance, v_motion), is_driven=True)

    def know(self, x: Parameters, payload: Float[np.ndarray, " phi"] | None = None) -> None:
        """Somebody who has been identified, with what is carried besides the arm."""
        self._put_in(self._maker.known(x, payload))

    def weigh(self, x: Parameters, place: WeightPlace, v_motion: float) -> None:
        """The same with anything up to `HEAVIEST_KG` at a place."""
        self._put_in(self._maker.weighed(x, place, v_motion))

    def _put_in(self, limits: PersonLimits, is_driven: bool = False) -> None:
        before = self._envelope.person
        person = GuardedPerson(limits, before.gravity_level if before else 0.0)
        person.drive(is_driven or (before is not None and before.is_driven))
        self._envelope.person = person
