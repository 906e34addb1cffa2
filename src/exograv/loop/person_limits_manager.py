"""Guard limits of the wearer in each phase of a session. Tables are made between two ticks, never within one."""

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
from exograv.safety.limits import PersonLimits
from exograv.safety.person import GuardedPerson

from .person_limits import limits_of_table
from .plausible_table import TableMaker

POSTURES = 64
"""Number of workspace postures at which the torque error of an uncertain arm is evaluated."""

V_MORE_RAD_S = 1.0
"""Trip velocity above the velocity of the motion, while the arm or a weight is unknown [rad/s]
(docs/explanation/safety.md)."""

UNKNOWN_J = 3.0
"""Energy in the tank while the arm is unknown [J], in addition to the work of the unknown torque over half of the
workspace."""

PATH_W = 2.0
"""Power allowed along a path in addition to carrying [W]. Damping of the arm's joints, hysteresis and the error of the
table's arm took 0.4 W on a tuning wearer (recupera_like, level 2, seed 1000)."""

Joints = Float[np.ndarray, " joint"]
Covariance = Float[np.ndarray, "parameter parameter"]


class LimitsMaker:
    """Factory of guard limits for one wearer in one machine, by the knowledge of the arm."""

    def __init__(self, assembly: Assembly, machine: CalibratedMachine, x: Parameters):
        """Prepare the postures. This takes seconds.

        Args:
            assembly: The machine with the arm in it.
            machine: The machine as calibrated.
            x: Parameters of this arm, or of the arm from the table.
        """
        self._assembly, self._maker = assembly, TableMaker(assembly, machine, x)
        self._workspace = sample_postures(assembly.description, POSTURES)
        self._layout = ParameterLayout.of(assembly)

    def expected(self, x: Parameters, covariance: Covariance, v_motion: float) -> PersonLimits:
        """Limits of an arm that is known by mean and covariance only, and is moved with up to `v_motion` [rad/s]."""
        margin = self._maker.margin(x, covariance, self._workspace)
        return self._unsure(x, np.zeros(self._layout.phi.stop), margin, v_motion)

    def known(self, x: Parameters, payload: Float[np.ndarray, " phi"] | None = None) -> PersonLimits:
        """Limits of an identified arm, with the payload that it carries."""
        return _driven(limits_of_table(self._assembly, self._maker.table(x, payload)))

    def weighed(self, x: Parameters, place: WeightPlace, v_motion: float) -> PersonLimits:
        """Limits of an identified arm with a weight up to `HEAVIEST_KG` at `place`. No other weight is plausible."""
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
        """Return the limits for an arm whose torque is uncertain by `margin` [N·m]."""
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
    """Add the power and energy that are allowed while control moves the arm along a path."""
    return replace(limits, driven_W=PATH_W, driven_J=UNKNOWN_J)


class PersonLimitsManager:
    """Setter of the wearer's limits in an envelope, phase by phase."""

    def __init__(self, envelope: Envelope, assembly: Assembly, machine: CalibratedMachine, x: Parameters):
        """Prepare as in `LimitsMaker`. This takes seconds."""
        self._envelope, self._maker = envelope, LimitsMaker(assembly, machine, x)

    def expect(self, x: Parameters, covariance: Covariance, v_motion: float) -> None:
        """Set the limits of an arm known by mean and covariance only, moved with up to `v_motion` [rad/s]."""
        self._put_in(self._maker.expected(x, covariance, v_motion), is_driven=True)

    def know(self, x: Parameters, payload: Float[np.ndarray, " phi"] | None = None) -> None:
        """Set the limits of an identified arm, with the payload that it carries."""
        self._put_in(self._maker.known(x, payload))

    def weigh(self, x: Parameters, place: WeightPlace, v_motion: float) -> None:
        """Set the limits of an identified arm with any weight up to `HEAVIEST_KG` at `place`."""
        self._put_in(self._maker.weighed(x, place, v_motion))

    def _put_in(self, limits: PersonLimits, is_driven: bool = False) -> None:
        before = self._envelope.person
        person = GuardedPerson(limits, before.gravity_level if before else 0.0)
        person.drive(is_driven or (before is not None and before.is_driven))
        self._envelope.person = person
