"""How much of the machine's friction is taken off the wearer while floating: a share, and none at rest."""

import casadi as ca

V_OFF = 0.05
"""Speed below which nothing is returned [rad/s]: the direction is not known there (docs/safety.md)."""

V_FULL = 0.10
"""Speed from which the whole share is returned [rad/s]."""


def friction_share_torque(coulomb: ca.SX, viscous: ca.SX, v: ca.SX) -> ca.SX:
    """Torque (joint,) [N·m] along the motion that cancels friction; a share of at most 0.8 of it stays passive.

    Zero below `V_OFF`, whole from `V_FULL`, with a smooth step between.
    """
    speed = ca.fabs(v)
    s = ca.fmin(ca.fmax((speed - V_OFF) / (V_FULL - V_OFF), 0), 1)
    # fmin and fmax would turn a NaN into 0 or 1: v keeps it alive in the product.
    return (3 * s**2 - 2 * s**3) * (coulomb * ca.sign(v) + viscous * v)
