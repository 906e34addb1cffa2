"""Where the arm is, given where the exoskeleton is: the posture of least energy, and how it moves along."""

from dataclasses import dataclass

import casadi as ca

from exograv.spatial import solve_symmetric

from .cuff_energy import CuffEnergy as CuffEnergy
from .cuff_energy import cuff_energy as cuff_energy

PIVOT_MIN = 0.05  # N·m/rad: a freedom held more softly than this is treated as near singular and damped


@dataclass(frozen=True)
class StaticLoad:
    """What the arm's freedoms need at rest, at one posture z."""

    torque: ca.SX
    """Weight and elasticity (freedom,) [N·m]."""

    stiffness: ca.SX
    """Its derivative with respect to z (freedom, freedom) [N·m/rad]."""


@dataclass(frozen=True)
class Closure:
    """The closed posture at one y, as expressions."""

    z: ca.SX
    """Arm freedoms (freedom,) [rad]."""

    G: ca.SX
    """∂z/∂y (freedom, joint)."""

    strain: ca.SX
    """dE/dy along the closed posture (joint,) [N·m]: what the strained cuffs ask of the motors."""

    slope: ca.SX
    """What is left of ∂E/∂z + load (freedom,) [N·m]; zero where closed. The caller checks it every tick."""

    pivot: ca.SX
    """Smallest pivot of the Hessian [N·m/rad]; below `PIVOT_MIN` the posture is near singular and G damped."""

    H: ca.SX
    """Full Hessian (freedom, freedom) of cuffs and load at the posture [N·m/rad]."""

    cosine: ca.SX
    """Of the most turned cuff's rotation [-]; below `TWIST_COSINE_MIN` the arm lies twisted in its cuffs."""


def newton_step(cuffs: CuffEnergy, y: ca.SX, z: ca.SX, fit: ca.SX, load: StaticLoad | None = None) -> ca.SX:
    """One full Newton step from z (freedom,) towards the closed posture at y; after the predictor one is enough.

    Under a `load`, taken at z, the arm sags in its cuffs: closed is where cuffs and load balance.
    """
    H, slope = _at(cuffs, [cuffs.H, cuffs.slope], y, z, fit)
    if load is not None:
        H, slope = H + load.stiffness, slope + load.torque
    step, _ = solve_symmetric(H, slope, PIVOT_MIN)
    return z - step


def closure(cuffs: CuffEnergy, y: ca.SX, z: ca.SX, fit: ca.SX, load: StaticLoad | None = None) -> Closure:
    """All that follows from a posture z (freedom,) that is closed under `load` at y."""
    wanted = [cuffs.H, cuffs.H_zy, cuffs.slope, cuffs.strain, cuffs.cosine]
    H, H_zy, cuff_slope, strain, cosine = _at(cuffs, wanted, y, z, fit)
    slope = cuff_slope
    if load is not None:
        H, slope = H + load.stiffness, slope + load.torque
    minus_G, pivot = solve_symmetric(H, H_zy, PIVOT_MIN)
    G = -minus_G
    # Along the posture's path; where nothing loads the arm ∂E/∂z is zero and the second term too.
    return Closure(z, G, strain + G.T @ cuff_slope, slope, pivot, H, cosine)


def velocity_bias(cuffs: CuffEnergy, closed: Closure, y: ca.SX, fit: ca.SX, v: ca.SX) -> ca.SX:
    """Acceleration (freedom,) of the arm's freedoms at constant velocity `v` (joint,) of the exoskeleton: Ġ v [rad/s²].

    −H⁻¹ · (second derivative of ∂E/∂z by time at the velocity (v, G v)): exact, and less than half the size of
    differentiating G.
    """
    evaluate = ca.Function("bent", [cuffs.y, cuffs.z, cuffs.fit, cuffs.along], [cuffs.slope_bent])
    bias, _ = solve_symmetric(closed.H, evaluate(y, closed.z, fit, ca.vertcat(v, closed.G @ v)), PIVOT_MIN)
    return -bias


def _at(cuffs: CuffEnergy, expressions: list[ca.SX], y: ca.SX, z: ca.SX, fit: ca.SX) -> list[ca.SX]:
    return ca.Function("at", [cuffs.y, cuffs.z, cuffs.fit], expressions).call([y, z, fit])
