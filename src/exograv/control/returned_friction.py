"""Partial compensation of the machine's friction while floating, by a virtual spring that slips.

The travel of a joint stretches the spring, and the motor applies the spring torque along the travel. The spring slips
at a share of the least friction that the calibration allows. It therefore never exceeds friction, at any delay or
noise. It is also softer than friction before breakaway, so that it does not amplify tremor
(docs/explanation/friction.md).
"""

from dataclasses import dataclass

import casadi as ca

from exograv.dynamics.friction import Friction, Joints

SHARE = 0.8
"""Compensated share of the least friction [-]. The rest covers effects that calibration does not see, as
ripple (docs/explanation/friction.md)."""

WARMED = 0.9
"""Smallest friction of a warm machine over that of the cold one [-]; it falls by this much in a good laboratory."""

CERTAINTY = 2.0
"""Standard deviations between estimate and least friction [-]: 97.5 %, one-sided."""

TRAVEL = 8e-4
"""Travel that stretches the spring to Coulomb friction [rad]. It must be longer than the travel at which friction
breaks away, which is assumed; the twin has about 4e-4. It equals 17 steps of a 17-bit encoder."""


@dataclass(frozen=True)
class ReturnedFriction:
    """Result of one step of the law."""

    tau: ca.SX
    """Compensating torque along the motion (joint,) [N·m]."""

    spring: ca.SX
    """Spring part of the torque, the start of the next step (joint,) [N·m]."""


def returned_friction(
    friction: Friction, friction_sd: Friction, load: ca.SX, way: ca.SX, v: ca.SX, spring: ca.SX
) -> ReturnedFriction:
    """Compute the compensation of friction; zero if the joints have not moved yet.

    Args:
        friction: Current estimate of the friction.
        friction_sd: Standard deviation of each friction parameter.
        load: Torque that the gears carry (joint,) [N·m].
        way: Travel since the last step (joint,) [rad].
        v: Joint velocities (joint,) [rad/s].
        spring: Spring torque of the last step (joint,) [N·m].

    Source: compensation by a model of smaller friction, for passivity, after Mahvash & Okamura (2007), IEEE T-RO
    23:1240. A slipping spring replaces their Dahl model; it depends on travel, not on time, as in Hayward et al.
    (2009), IEEE TCST 17:688.
    """
    forward, backward = least_friction(friction, friction_sd, load)
    stretched = spring + friction.coulomb / TRAVEL * way
    # The excess is subtracted, not clipped: minimum and maximum would turn a NaN into a torque.
    slipped = ca.fmax(stretched - SHARE * forward, 0) - ca.fmax(-SHARE * backward - stretched, 0)
    spring = stretched - slipped
    viscous = WARMED * friction.viscous - CERTAINTY * _column(friction_sd.viscous)
    return ReturnedFriction(spring + SHARE * viscous * v, spring)


def least_friction(friction: Friction, friction_sd: Friction, load: ca.SX) -> tuple[ca.SX, ca.SX]:
    """Least sliding friction without its viscous part, for forward and backward motion (joint,) [N·m]."""
    coulomb = WARMED * friction.coulomb - CERTAINTY * _column(friction_sd.coulomb)
    load_share = ca.fmax(_column(friction.load_share) - CERTAINTY * _column(friction_sd.load_share), 0)
    least = coulomb + load_share * ca.fabs(load) - CERTAINTY * _column(friction_sd.asymmetry)
    asymmetry = _column(friction.asymmetry)
    return ca.fmax(least + asymmetry, 0), ca.fmax(least - asymmetry, 0)


def _column(values: Joints) -> ca.SX:
    return values if isinstance(values, ca.SX) else ca.SX(ca.DM(values))
