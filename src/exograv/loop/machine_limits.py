"""Limits of a machine for the guard, from the machine's description."""

import numpy as np

from exograv.errors import ConfigError
from exograv.model.description import RigDescription
from exograv.safety.limits import Limits

DAMPING = {"shoulder": 10.0, "elbow": 4.0, "wrist": 0.4}
"""Damping of the soft descent [N·m·s/rad] (docs/explanation/safety.md, SS1). The wrist's value is assumed: the elbow's,
scaled by the moments of inertia."""


WITHOUT_MOTOR_NM = 1e-3
"""Torque limit of a joint without motor [N·m]. Zero would be exact, but an envelope needs a positive limit."""


def refuse_motorless(description: RigDescription) -> None:
    """Refuse a machine that has a joint without motor: it cannot carry an arm.

    Raises:
        ConfigError: Names the joints without motor.
    """
    if description.motorless:
        raise ConfigError(
            f"{description.name} has no motor at {', '.join(description.motorless)}: it measures motion of an arm, but "
            "cannot carry the arm. Choose a machine with motors (exograv rigs)."
        )


def limits(description: RigDescription, records_only: bool = False) -> Limits:
    """Envelope of this machine. With `records_only`, no torque can pass the envelope, with or without motors."""
    damping = np.array([DAMPING[place] for place in description.places])
    torque_max_Nm = description.per_actuator("torque_max_Nm")
    if records_only:
        torque_max_Nm = np.full(len(damping), np.nan)
    return Limits(np.where(np.isnan(torque_max_Nm), WITHOUT_MOTOR_NM, torque_max_Nm), damping)
