"""Drive torque that holds an arm at rest, by origin; linear in the arm's mass, to assess a machine.

The sag of the cuffs is neglected, which changes some percent for a well aligned arm. The tick includes the sag.
"""

from dataclasses import dataclass

import casadi as ca
import numpy as np
from jaxtyping import Float

from exograv import kernel
from exograv.model.arm import held_weight
from exograv.model.assembly import Assembly
from exograv.model.kinematics import body_poses
from exograv.model.loops import (
    LoopSolver,
    arm_hinges,
    arm_poses,
    arm_positions,
    cuff_residuals,
    fit_names,
    scaled_stiffness,
)

from .loop_torque import GRAVITY
from .weight import weight

Postures = Float[np.ndarray, "posture joint"]


@dataclass(frozen=True)
class CarriedTorque:
    """Torque of the drives at rest, one row per posture [N·m]."""

    exo: Postures
    """Torque that carries the machine's links [N·m]."""

    arm: Postures
    """Torque that carries the arm of the table, or both arms [N·m]."""

    hand: Postures
    """Torque that carries 1 kg in each hand [N·m]."""


def carried(assembly: Assembly, postures: Postures, solver: LoopSolver | None = None) -> CarriedTorque:
    """Drive torque by origin at these postures of the machine [rad]; an existing `solver` of these loops is reused."""
    evaluate, solver = kernel.compile(kernel.Recipe(_function, (assembly,))), solver or LoopSolver(assembly)
    rows = []
    for y in postures:
        z, _ = solver.solve(y)
        exo, loads, by_joint, by_freedom = evaluate.of(y, z)
        # G = ∂z/∂y of least cuff strain by Gauss–Newton, which is exact if the cuffs are not strained.
        # A kernel returns the single column of a one-joint machine as a vector.
        G = -np.linalg.lstsq(by_freedom, by_joint.reshape(len(by_freedom), assembly.n), rcond=None)[0]
        rows.append(np.vstack([exo, loads.T @ G]))
    return CarriedTorque(*np.array(rows).transpose(1, 0, 2))


def _function(assembly: Assembly) -> ca.Function:
    """Torque of the links (joint,), of arm and hands on the freedoms (freedom, 2), and the cuffs' two Jacobians."""
    arm, gravity = assembly.arm, ca.SX(ca.DM(GRAVITY))
    y, z = ca.SX.sym("y", assembly.n), ca.SX.sym("z", assembly.n_freedoms)
    fit = ca.SX.zeros(len(fit_names(assembly)))
    exo, _ = weight(assembly.exo, body_poses(assembly.exo, y), ca.SX(ca.DM(assembly.exo.phi.T)), gravity)
    x = arm_positions(arm, z, fit)
    poses, hinges = arm_poses(assembly, z, fit), arm_hinges(assembly, fit)
    weights = sum((held_weight(arm, 1.0, limb) for limb in range(len(arm.limbs))), np.zeros_like(arm.phi))
    loads = []
    for phi in (arm.phi, weights):
        masses = np.zeros((10, len(arm.tree.joints)))
        masses[:, list(arm.bodies)] = phi.reshape(-1, 10).T
        loads.append(ca.jacobian(x, z).T @ weight(arm.tree, poses, ca.SX(ca.DM(masses)), gravity, hinges)[0])
    strained = ca.sqrt(scaled_stiffness(assembly, fit)) * cuff_residuals(assembly, y, z, fit)[0]
    results = {
        "exo": exo,
        "loads": ca.horzcat(*loads),
        "by_joint": ca.jacobian(strained, y),
        "by_freedom": ca.jacobian(strained, z),
    }
    return ca.Function("carried", [y, z], list(results.values()), ["y", "z"], list(results))
