"""Joint friction: motor torque that is lost before it acts on the arm."""

from dataclasses import dataclass

import casadi as ca
import numpy as np
from jaxtyping import Float

Joints = Float[np.ndarray, " joint"] | ca.SX
"""Values per joint: numbers, or an expression if they are being learned."""


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
    """Friction added in positive direction of motion, and subtracted in negative direction [N·m]."""

    v_stribeck: Joints
    """Speed at which the breakaway excess has fallen to 1/e [rad/s]."""

    v_rest: float
    """Speed below which the encoder cannot tell the direction of motion [rad/s]."""


def friction_torque(friction: Friction, v: ca.SX, load: ca.SX) -> ca.SX:
    """Torque (joint,) that friction takes from the motor at velocity `v` (joint,) under `load` (joint,) [N·m].

        tau = (coulomb · stribeck + load_share · |load|) · sign + asymmetry · sign² + viscous · v
        sign = tanh(v / v_rest),   stribeck = 1 + (breakaway − 1) · exp(−|v / v_stribeck|^1.3)

    Returns:
        Joint torque [N·m] with the sign of `v`. Added to a command it cancels friction; subtracted from a measured
        torque it gives the load.

    Source: form after Bittencourt & Gunnarsson 2012, without temperature (unverified, docs/reference/robots.md).
    """
    # tanh in place of sign: encoder noise at rest must not make the motor chatter, and identification needs a
    # gradient at v = 0.
    sign = ca.tanh(v / friction.v_rest)
    stribeck = 1 + (_column(friction.breakaway) - 1) * ca.exp(-(ca.fabs(v / _column(friction.v_stribeck)) ** 1.3))
    size = _column(friction.coulomb) * stribeck + _column(friction.load_share) * ca.fabs(load)
    return size * sign + _column(friction.asymmetry) * sign**2 + _column(friction.viscous) * v


def _column(values: Joints) -> ca.SX:
    return values if isinstance(values, ca.SX) else ca.SX(ca.DM(values))
