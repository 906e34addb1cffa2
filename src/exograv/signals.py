"""Values that the parts of exograv exchange in each tick: flat NumPy arrays of fixed size.

They are named tuples, which are made five times as fast as frozen data classes.
"""

import enum
from typing import NamedTuple

import numpy as np
from jaxtyping import Float

Joints = Float[np.ndarray, " joint"]


class TorqueSource(enum.Enum):
    """Source of the measured torque of a joint."""

    CURRENT = "motor current"
    JOINT_SENSOR = "joint torque sensor"
    SPRING = "spring deflection"
    CUFF_SENSOR = "cuff force sensor"


class JointState(NamedTuple):
    """Measurements of a machine in one period, one entry per actuated joint."""

    t: float
    """Time of the measurement on the rig's clock [s]."""

    sequence: int
    """Number of the measurement; a gap in the numbers means a lost measurement."""

    q: Joints
    """Joint positions from the joint encoders [rad]."""

    current: Joints
    """Motor currents [A]; NaN if the source is not `CURRENT`."""

    tau: Joints
    """Joint torque from a sensor [N·m]; NaN if the source is `CURRENT`."""

    torque_source: TorqueSource
    """Source of the measured torque, the same for all joints."""

    q_motor: Joints | None = None
    """Joint positions from the encoders on the motor shafts [rad]; None if there are none."""

    faulty: tuple[int, ...] = ()
    """Joints whose drive reports a fault."""


class Command(NamedTuple):
    """Command to the motors, one entry per actuated joint."""

    t: float
    """Time of the decision on the rig's clock [s]."""

    sequence: int
    """Number of the `JointState` that the command answers."""

    valid_until: float
    """Expiry time on the rig's clock [s]. After this time the command must not become torque."""

    tau: Joints
    """Commanded joint torque [N·m]."""

    current: Joints
    """Commanded motor current [A]: the commanded torque by the calibrated actuator."""

    damping: Joints | None = None
    """Damping that each drive adds from its own encoder [N·m·s/rad]; None without damping."""


class Reference(NamedTuple):
    """Reference of the exoskeleton, one entry per actuated joint."""

    q: Joints
    """Joint position [rad]."""

    v: Joints
    """Joint velocity [rad/s]."""

    a: Joints
    """Joint acceleration [rad/s²]."""
