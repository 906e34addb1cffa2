"""What crosses rooms in one tick: flat, fixed size, NumPy."""

import enum
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

Joints = Float[np.ndarray, " joint"]


class TorqueSource(enum.Enum):
    """Where the measured torque of a joint comes from."""

    CURRENT = "motor current"
    JOINT_SENSOR = "joint torque sensor"
    SPRING = "spring deflection"
    CUFF_SENSOR = "cuff force sensor"


@dataclass(frozen=True, slots=True)
class JointState:
    """What a machine measures in one period, one entry per actuated joint."""

    t: float
    """Time of the measurement on the rig's clock [s]."""

    sequence: int
    """Counts the measurements; a gap is a lost one."""

    q: Joints
    """Joint positions by the encoders [rad]."""

    current: Joints
    """Motor currents [A]; NaN where the source is not `CURRENT`."""

    tau: Joints
    """Torque by a sensor [N·m]; NaN where the source is `CURRENT`."""

    torque_source: TorqueSource

    q_motor: Joints | None = None
    """The same positions by the encoders on the motors' shafts [rad]; None where there are none."""

    faulty: tuple[int, ...] = ()
    """Joints whose drive reports a fault."""


@dataclass(frozen=True, slots=True)
class Command:
    """What the motors are told, one entry per actuated joint."""

    t: float
    """Time of the decision on the rig's clock [s]."""

    sequence: int
    """The `JointState` that this answers."""

    valid_until: float
    """The command is void after this time on the rig's clock [s]: it never becomes torque later."""

    tau: Joints
    """Commanded joint torque [N·m]."""

    current: Joints
    """The same as motor current [A], by the calibrated actuator."""

    damping: Joints | None = None
    """What each drive brakes its own motor with, by its own encoder [N·m·s/rad]; None where nothing brakes."""


@dataclass(frozen=True, slots=True)
class Reference:
    """Where the exoskeleton should be, one entry per actuated joint."""

    q: Joints
    """[rad]"""

    v: Joints
    """[rad/s]"""

    a: Joints
    """[rad/s²]"""
