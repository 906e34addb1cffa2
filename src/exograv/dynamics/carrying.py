"""What the drives must give to hold an arm at rest, by origin: linear in the arm's mass, to judge a machine by.

The cuffs do not sag here: where the arm is well aligned that changes some percent. The tick knows better.
"""

from dataclasses import dataclass

import casadi as ca
import numpy as np
from jaxtyping import Float

from exograv import kernel
from exograv.model.arm import held_weight
from exograv.model.assembly import Assembly
from exograv.model.kinematics import body_poses
from exograv.model.loops import LoopSolver, arm_positions, arm_roots, cuff_residuals, fit_names, scaled_stiffness

from .loop_torque import GRAVITY
from .weight import weight

Postures = Float[np.ndarray, "posture joint"]


@dataclass(frozen=True)
class CarriedTorque:
    """Torque of the drives at rest, one row a posture [N·m]."""

    exo: Postures
    """That carries the machine's links."""

    arm: Postures
    """That carries the arm of the table, or both."""

    hand: Postures
    """That carries 1 kg in each hand."""


def carried(assembly: Assembly, postures: Postures, solver: LoopSolver | None = None) -> CarriedTorque:
    """By origin, at these postures of the machine [rad]; with the solver of these loops, if there is one already."""
    evaluate, solver = kernel.compile(_function(assembly)), solver or LoopSolver(assembly)
    rows = []
    for y in postures:
        z, _ = solver.solve(y)
        exo, loads, by_joint, by_freedom = evaluate.of(y, z)
        # Least strain of the cuffs gives how the arm follows: Gauss and Newton's, exact where nothing is strained.
        G = -np.linalg.lstsq(by_freedom, by_joint, rcond=None)[0]
        rows.append(np.vstack([exo, loads.T @ G]))
    return CarriedTorque(*np.array(rows).transpose(1, 0, 2))


def _function(assembly: Assembly) -> ca.Function:
    """Torque of the links (joint,), of arm and hands on the freedoms (freedom, 2), and the cuffs' two Jacobians."""
    arm, gravity = assembly.arm, ca.SX(ca.DM(GRAVITY))
    y, z = ca.SX.sym("y", assembly.n), ca.SX.sym("z", assembly.n_freedoms)
    fit = ca.SX.zeros(len(fit_names(assembly)))
    exo, _ = weight(assembly.exo, body_poses(assembly.exo, y), ca.SX(ca.DM(assembly.exo.phi.T)), gravity)
    x = arm_positions(arm, z, fit)
    poses = body_poses(arm.tree, x, arm_roots(assembly, fit))
    weights = sum((held_weight(arm, 1.0, limb) for limb in range(len(arm.limbs))), np.zeros_like(arm.phi))
    loads = []
    for phi in (arm.phi, weights):
        masses = np.zeros((10, len(arm.tree.joints)))
        masses[:, list(arm.bodies)] = phi.reshape(-1, 10).T
        loads.append(ca.jacobian(x, z).T @ weight(arm.tree, poses, ca.SX(ca.DM(masses)), gravity)[0])
    strained = ca.sqrt(scaled_stiffness(assembly, fit)) * cuff_residuals(assembly, y, z, fit)[0]
    results = {
        "exo": exo,
        "loads": ca.horzcat(*loads),
        "by_joint": ca.jacobian(strained, y),
        "by_freedom": ca.jacobian(strained, z),
    }
    return ca.Function("carried", [y, z], list(results.values()), ["y", "z"], list(results))
