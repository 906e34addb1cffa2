"""Joint friction: the torque a motor spends before the arm feels anything."""

from dataclasses import dataclass

import casadi as ca
import numpy as np
from jaxtyping import Float

Joints = Float[np.ndarray, " joint"]


@dataclass(frozen=True)
class Friction:
    """Coulomb, Stribeck, viscous and load-dependent friction, one entry per joint."""

    coulomb: Joints
    """Torque that opposes motion at any speed [N·m]."""

    viscous: Joints
    """Further torque per unit of speed [N·m·s/rad]."""

    breakaway: Joints
    """Coulomb torque at rest over Coulomb torque in motion [-]; 1 without Stribeck effect."""

    load_share: Joints
    """Further Coulomb torque per torque that the gear carries [-]."""

    asymmetry: Joints
    """Torque that is added in positive and taken in negative direction, beside gravity [N·m]."""

    v_stribeck: float
    """Speed over which the breakaway excess falls to 1/e [rad/s]."""

    v_rest: float
    """Speed below which the encoder cannot tell the direction of motion [rad/s]."""


def direction(v: ca.SX, v_rest: ca.SX | float) -> ca.SX:
    """Direction of motion (joint,), −1 to 1.

    tanh in place of sign: encoder noise at rest must not make the motor chatter, and identification needs a
    gradient at v = 0.
    """
    return ca.tanh(v / v_rest)


def friction_torque(friction: Friction, coulomb: ca.SX, viscous: ca.SX, v: ca.SX, load: ca.SX) -> ca.SX:
    """Torque (joint,) that friction takes from the motor at velocity `v` (joint,) under `load` (joint,) [N·m].

        tau = (coulomb · stribeck + load_share · |load| + asymmetry · sign) · tanh(v / v_rest) + viscous · v
        stribeck = 1 + (breakaway − 1) · exp(−(v / v_stribeck)²)

    Args:
        friction: The joints as calibrated; its `coulomb` and `viscous` are not used.
        coulomb: As in `Friction` (joint,): learned on while the machine warms up.
        viscous: As in `Friction` (joint,).
        v: Joint velocity [rad/s].
        load: Torque that the gear carries [N·m].

    Returns:
        Joint torque [N·m] with the sign of `v`: added to a command it cancels friction, taken from a measured torque
        it leaves the load.

    Source: form after Bittencourt & Gunnarsson 2012, without temperature (unverified, docs/arm.md).
    """
    stribeck = 1 + ca.DM(friction.breakaway - 1) * ca.exp(-((v / friction.v_stribeck) ** 2))
    sign = direction(v, friction.v_rest)
    size = coulomb * stribeck + ca.DM(friction.load_share) * ca.fabs(load)
    return size * sign + ca.DM(friction.asymmetry) * sign**2 + viscous * v
