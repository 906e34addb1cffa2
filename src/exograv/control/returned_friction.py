"""How much of the machine's friction is taken off the wearer while floating: a share, by a spring that slips.

The way of a joint stretches the spring; what it pulls, the motor gives along the way. It slips at a share of the least
friction that the calibration allows, so that it never outweighs friction, whatever the delay or the noise; and it is
softer than friction is before it breaks away, so that it feeds no tremor either (docs/friction.md).
"""

from dataclasses import dataclass

import casadi as ca

from exograv.dynamics.friction import Friction, Joints

SHARE = 0.8
"""Returned of the least friction [-]; the rest is kept for what no calibration sees, as ripple (docs/safety.md)."""

WARMED = 0.9
"""Friction of a warm machine over that of the cold one, at least [-]: it falls by as much in a good laboratory."""

CERTAINTY = 2.0
"""Standard deviations below the estimate that count as least: 97.5 % on this side [-]."""

TRAVEL = 8e-4
"""Way over which the spring would be stretched to Coulomb friction [rad]. It has to be more than friction itself takes
to break away: assumed, some 4e-4 in the twin. 17 encoder steps of 17 bits."""


@dataclass(frozen=True)
class ReturnedFriction:
    """One step of the law."""

    tau: ca.SX
    """Along the motion (joint,) [N·m]."""

    spring: ca.SX
    """The spring's part of it, where the next step starts from (joint,) [N·m]."""


def returned_friction(
    friction: Friction, friction_sd: Friction, load: ca.SX, way: ca.SX, v: ca.SX, spring: ca.SX
) -> ReturnedFriction:
    """What the motors give back of friction; zero where the joints have not moved yet.

    Args:
        friction: As believed now.
        friction_sd: One standard deviation of each parameter.
        load: Torque that the gears carry (joint,) [N·m].
        way: Since the last step (joint,) [rad].
        v: Joint velocities (joint,) [rad/s].
        spring: Of the last step (joint,) [N·m].

    Source: friction returned by a model of less of it, for passivity, after Mahvash & Okamura (2007), IEEE T-RO
    23:1240; a spring that slips in place of their Dahl model, over way in place of time as in Hayward et al. (2009),
    IEEE TCST 17:688.
    """
    forward, backward = least_friction(friction, friction_sd, load)
    stretched = spring + friction.coulomb / TRAVEL * way
    # Taken off, not clipped: minimum and maximum would turn a NaN into a torque.
    slipped = ca.fmax(stretched - SHARE * forward, 0) - ca.fmax(-SHARE * backward - stretched, 0)
    spring = stretched - slipped
    viscous = WARMED * friction.viscous - CERTAINTY * _column(friction_sd.viscous)
    return ReturnedFriction(spring + SHARE * viscous * v, spring)


def least_friction(friction: Friction, friction_sd: Friction, load: ca.SX) -> tuple[ca.SX, ca.SX]:
    """Least sliding friction without its viscous part against motion forward and backward (joint,) [N·m]."""
    coulomb = WARMED * friction.coulomb - CERTAINTY * _column(friction_sd.coulomb)
    load_share = ca.fmax(_column(friction.load_share) - CERTAINTY * _column(friction_sd.load_share), 0)
    least = coulomb + load_share * ca.fabs(load) - CERTAINTY * _column(friction_sd.asymmetry)
    asymmetry = _column(friction.asymmetry)
    return ca.fmax(least + asymmetry, 0), ca.fmax(least - asymmetry, 0)


def _column(values: Joints) -> ca.SX:
    return values if isinstance(values, ca.SX) else ca.SX(ca.DM(values))
