"""Closure of the loops: arm posture of least energy for a posture of the exoskeleton, and its derivatives."""

from dataclasses import dataclass

import casadi as ca

from exograv.spatial import solve_symmetric

from .cuff_energy import CuffEnergy as CuffEnergy
from .cuff_energy import cuff_energy as cuff_energy

PIVOT_MIN = 0.05  # N·m/rad: a freedom with less stiffness is treated as near singular and damped


@dataclass(frozen=True)
class StaticLoad:
    """Load of the arm's freedoms at rest, at one posture z."""

    torque: ca.SX
    """Torque of weight and elasticity (freedom,) [N·m]."""

    stiffness: ca.SX
    """Derivative of the torque with respect to z (freedom, freedom) [N·m/rad]."""


@dataclass(frozen=True)
class Closure:
    """Closed posture at one y, as expressions."""

    z: ca.SX
    """Arm freedoms (freedom,) [rad]."""

    G: ca.SX
    """Derivative ∂z/∂y (freedom, joint)."""

    strain: ca.SX
    """Total derivative dE/dy along the closed posture (joint,) [N·m]: motor torque for the strained cuffs."""

    slope: ca.SX
    """Remaining gradient ∂E/∂z + load (freedom,) [N·m]; zero if closed. The caller checks it every tick."""

    pivot: ca.SX
    """Smallest pivot of the Hessian [N·m/rad]; below `PIVOT_MIN` the posture is near singular and G is damped."""

    H: ca.SX
    """Full Hessian (freedom, freedom) of cuffs and load at the posture [N·m/rad]."""

    cosine: ca.SX
    """Cosine of the most turned cuff's rotation [-]; below `TWIST_COSINE_MIN` the arm is twisted in its cuffs."""

    stretch: ca.SX
    """Displacement of each cuff from its rest place (3, cuff), in the cuff's axes [m]."""


def newton_step(cuffs: CuffEnergy, y: ca.SX, z: ca.SX, fit: ca.SX, load: StaticLoad | None = None) -> ca.SX:
    """Make one full Newton step from z (freedom,) towards the closed posture at y; after the predictor one is enough.

    Under a `load`, taken at z, the arm sags in its cuffs. The closed posture balances cuffs and load.
    """
    H, slope = _at(cuffs, [cuffs.H, cuffs.slope], y, z, fit)
    if load is not None:
        H, slope = H + load.stiffness, slope + load.torque
    step, _ = solve_symmetric(H, slope, PIVOT_MIN)
    return z - step


def closure(cuffs: CuffEnergy, y: ca.SX, z: ca.SX, fit: ca.SX, load: StaticLoad | None = None) -> Closure:
    """Compute derivatives and strain of a posture z (freedom,) that is closed under `load` at y."""
    wanted = [cuffs.H, cuffs.H_zy, cuffs.slope, cuffs.strain, cuffs.cosine, cuffs.stretch]
    H, H_zy, cuff_slope, strain, cosine, stretch = _at(cuffs, wanted, y, z, fit)
    slope = cuff_slope
    if load is not None:
        H, slope = H + load.stiffness, slope + load.torque
    minus_G, pivot = solve_symmetric(H, H_zy, PIVOT_MIN)
    G = -minus_G
    # Total derivative along the closed posture. Without load ∂E/∂z is zero, and the second term vanishes.
    return Closure(z, G, strain + G.T @ cuff_slope, slope, pivot, H, cosine, stretch)


def velocity_bias(cuffs: CuffEnergy, closed: Closure, y: ca.SX, fit: ca.SX, v: ca.SX) -> ca.SX:
    """Acceleration (freedom,) of the arm's freedoms at constant velocity `v` (joint,) of the exoskeleton: Ġ v [rad/s²].

    −H⁻¹ · (second time derivative of ∂E/∂z at the velocity (v, G v)). The expression is exact and has less than half
    the instructions of a derivative of G.
    """
    [bent] = _at(cuffs, [cuffs.slope_bent], y, closed.z, fit, ca.vertcat(v, closed.G @ v))
    bias, _ = solve_symmetric(closed.H, bent, PIVOT_MIN)
    return -bias


def _at(
    cuffs: CuffEnergy, expressions: list[ca.SX], y: ca.SX, z: ca.SX, fit: ca.SX, along: ca.SX | None = None
) -> list[ca.SX]:
    inputs, values = [cuffs.y, cuffs.z, cuffs.fit], [y, z, fit]
    if along is not None:
        inputs, values = [*inputs, cuffs.along], [*values, along]
    if cuffs.moved.is_valid_input():
        inputs, values = [*inputs, cuffs.moved], [*values, cuffs.moved]
    return ca.Function("at", inputs, expressions).call(values)
