"""Limits of a machine for the guard, from its description."""

import numpy as np

from exograv.errors import ConfigError
from exograv.model.description import RigDescription
from exograv.safety.envelope import Limits

DAMPING = {"shoulder": 10.0, "elbow": 4.0, "wrist": 0.4}
"""Of the soft descent [N·m·s/rad] (docs/safety.md, SS1); the wrist's is assumed, by the elbow's and their moments of
inertia."""


WITHOUT_MOTOR_NM = 1e-3
"""That a joint without motor may be asked for: nothing, but an envelope is no envelope at zero."""


def refuse_motorless(description: RigDescription) -> None:
    """A machine that is to carry an arm needs a motor at every joint.

    Raises:
        ConfigError: Names the joints without one.
    """
    if description.motorless:
        raise ConfigError(
            f"{description.name} has no motor at {', '.join(description.motorless)}: it measures how an arm moves and "
            "cannot carry it. Choose a machine with motors (exograv rigs)."
        )


def limits(description: RigDescription, records_only: bool = False) -> Limits:
    """The envelope of this machine; of one that only records, motors or not, no torque can pass it."""
    damping = np.array([DAMPING[place] for place in description.places])
    torque_max_Nm = description.per_actuator("torque_max_Nm")
    if records_only:
        torque_max_Nm = np.full(len(damping), np.nan)
    return Limits(np.where(np.isnan(torque_max_Nm), WITHOUT_MOTOR_NM, torque_max_Nm), damping)
