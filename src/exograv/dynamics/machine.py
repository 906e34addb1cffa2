"""Calibrated machine: the parameters with which control and identification compute torques."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from .actuator import ActuatorGain
from .friction import Friction

Joints = Float[np.ndarray, " joint"]


@dataclass(frozen=True)
class CalibratedMachine:
    """Calibrated machine: the result of stage 0, the calibration of the empty machine."""

    actuators: ActuatorGain
    friction: Friction
    friction_sd: Friction
    """Standard deviation of each friction parameter."""

    phi: Float[np.ndarray, "joint 10"]
    """Inertial parameters of the links, (10,) each [kg, kg·m, kg·m²]."""

    gravity: Float[np.ndarray, " 3"]
    """Gravity in the base frame, with the tilt of the base [m/s²]."""

    rotor_inertia: Joints
    """Rotor inertias, reflected to the joints [kg·m²]."""

    residual_sd: Joints
    """Standard deviation of the residual torque of the calibrated model [N·m]."""

    correlation_s: Joints
    """Integrated autocorrelation time of that residual [s]: time within which samples repeat each other."""
