"""Torque of the actuated joints for a motion of the closed loop of exoskeleton and arm."""

from dataclasses import dataclass

import casadi as ca
import numpy as np
from jaxtyping import Float

from exograv.model.assembly import Assembly
from exograv.model.loops import arm_hinges, arm_poses, arm_positions

from .closure import Closure, CuffEnergy, StaticLoad, velocity_bias
from .passive import passive_torque
from .rnea import rnea
from .weight import weight

GRAVITY = np.array([0.0, 0.0, -9.81])
"""Gravity in the base frame, z up [m/s²]."""


@dataclass(frozen=True)
class ArmExpression:
    """Parameters of an arm, as expressions."""

    phi: ca.SX
    """Inertial parameters (10 · segment,) of its segments in order."""

    fit: ca.SX
    """Fit of the arm in the machine (fit,), as in `model.loops.fit_names`."""

    stiffness: ca.SX
    """Passive joint stiffness (freedom,) [N·m/rad]."""

    spring_offset: ca.SX
    """Stiffness times neutral angle (freedom,) [N·m]."""

    damping: ca.SX
    """Passive joint damping (freedom,) [N·m·s/rad]."""


@dataclass(frozen=True)
class LoopTorque:
    """Torque of the actuated joints by origin; the sum is the motor torque before friction."""

    exo: ca.SX
    """Torque of the machine's links and rotors (joint,) [N·m]."""

    arm: ca.SX
    """Torque of the wearer's arm through the cuffs (joint,) [N·m]: Gᵀ times the torque on its own freedoms."""

    strain: ca.SX
    """Torque of the strained cuffs (joint,) [N·m]; carried in full at every gravity level."""

    @property
    def total(self) -> ca.SX:
        """Sum of the three parts (joint,) [N·m]."""
        return self.exo + self.arm + self.strain


def exo_torque(
    assembly: Assembly,
    phi_exo: Float[np.ndarray, "joint 10"] | ca.SX,
    rotor: ca.SX | ca.DM,
    motion: tuple[ca.SX, ca.SX, ca.SX],
    gravity: ca.SX | ca.DM | np.ndarray,
) -> ca.SX:
    """Torque (joint,) [N·m] of the machine alone for a motion (y, v, a), with reflected inertia `rotor` (joint,)."""
    y, v, a = motion
    phi = _expression(phi_exo.T)
    return rnea(assembly.exo, y, v, a, phi, _expression(gravity)) + rotor * a


def static_load(
    assembly: Assembly,
    arm: ArmExpression,
    z: ca.SX,
    gravity: ca.SX | ca.DM | np.ndarray,
    passive_share: ca.SX | float = 1.0,
) -> StaticLoad:
    """Load of the arm's freedoms at rest at z (freedom,): `arm_load` without motion, and its derivative.

    `passive_share` scales the arm's elasticity: one value for all freedoms, or one per freedom (freedom,).
    """
    tree, stretched = assembly.arm.tree, arm_positions(assembly.arm, z, arm.fit)
    poses, hinges = arm_poses(assembly, z, arm.fit), arm_hinges(assembly, arm.fit)
    torque, stiffness = weight(tree, poses, _tree_parameters(assembly, arm), _expression(gravity), hinges)
    # Chain rule to the freedoms, with the second derivative of the shoulder's shift.
    at, pull = ca.SX.sym("at", z.numel()), ca.SX.sym("pull", stretched.numel())
    x = arm_positions(assembly.arm, at, arm.fit)
    bend, slope = ca.hessian(ca.dot(pull, x), at)
    J, slope, bend = ca.substitute([ca.jacobian(x, at), slope, bend], [at, pull], [z, torque])
    elasticity = passive_torque(arm.stiffness, arm.spring_offset, arm.damping, z, ca.SX.zeros(z.numel()))
    return StaticLoad(
        slope + passive_share * elasticity,
        J.T @ stiffness @ J + bend + ca.diag(passive_share * arm.stiffness),
    )


def arm_load(
    assembly: Assembly,
    arm: ArmExpression,
    cuffs: CuffEnergy,
    closed: Closure,
    motion: tuple[ca.SX, ca.SX, ca.SX],
    gravity: ca.SX | ca.DM | np.ndarray,
    passive_share: ca.SX | float = 1.0,
) -> ca.SX:
    """Torque (freedom,) on the arm's own freedoms that moves and carries it, for a motion (y, v, a) of the machine.

    Gᵀ times this torque is the part of the actuated joints. The cuffs transmit it and sag under it.
    """
    y, v, a = motion
    v_z = closed.G @ v
    a_z = closed.G @ a + velocity_bias(cuffs, closed, y, arm.fit, v)
    z = ca.SX.sym("z", closed.z.numel())
    fit = ca.SX.sym("fit", arm.fit.numel())
    along = ca.SX.sym("along", z.numel())
    x = arm_positions(assembly.arm, z, fit)
    S = ca.jacobian(x, z)
    bias = ca.jtimes(S @ along, z, along)
    x_at, S_at, bias_at = ca.Function("tree", [z, fit, along], [x, S, bias]).call([closed.z, arm.fit, v_z])
    tree = assembly.arm.tree
    phi = _tree_parameters(assembly, arm)
    hinges = arm_hinges(assembly, arm.fit)
    tau_tree = rnea(tree, x_at, S_at @ v_z, S_at @ a_z + bias_at, phi, _expression(gravity), hinges)
    passive = passive_torque(arm.stiffness, arm.spring_offset, arm.damping, closed.z, v_z)
    return S_at.T @ tau_tree + passive_share * passive


def _tree_parameters(assembly: Assembly, arm: ArmExpression) -> ca.SX:
    """Inertial parameters (10, body) of the arm's tree; its auxiliary bodies have no mass."""
    phi = ca.SX.zeros(10, len(assembly.arm.tree.joints))
    for i, body in enumerate(assembly.arm.bodies):
        phi[:, body] = arm.phi[10 * i : 10 * (i + 1)]
    return phi


def _expression(numbers: np.ndarray | ca.DM | ca.SX) -> ca.SX:
    return ca.SX(ca.DM(numbers)) if isinstance(numbers, np.ndarray) else ca.SX(numbers)
