"""A machine as its calibration knows it: what every torque of control and identification is computed with."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from .actuator import ActuatorGain
from .friction import Friction

Joints = Float[np.ndarray, " joint"]


@dataclass(frozen=True)
class CalibratedMachine:
    """Result of stage 0 on the empty machine."""

    actuators: ActuatorGain
    friction: Friction
    friction_sd: Friction
    """One standard deviation of each friction parameter."""

    phi: Float[np.ndarray, "joint 10"]
    """Inertial parameters of the links."""

    gravity: Float[np.ndarray, " 3"]
    """In the base frame, as the base stands [m/s²]."""

    rotor_inertia: Joints
    """At the joints [kg·m²]."""

    residual_sd: Joints
    """What the calibrated model could not explain of the measured torque [N·m]."""

    correlation_s: Joints
    """Integrated autocorrelation time of that residual [s]: how long one sample says the same as the next."""
