"""Torque on the arm's joints from wrenches measured at the cuffs, by virtual work."""

import casadi as ca

from exograv.model.assembly import Assembly
from exograv.model.kinematics import body_poses, turning
from exograv.model.loops import arm_poses, cuff_pairs


def cuff_torque(assembly: Assembly, y: ca.SX, z: ca.SX, fit: ca.SX, wrenches: ca.SX) -> ca.SX:
    """Torque (freedom,) [N·m] on the arm's freedoms at z from `wrenches` (6, cuff) on the arm, the machine at y.

        tau_k = f · ∂p/∂z_k + (m − p × f) · ω_k,   ω_k = vee(∂R/∂z_k Rᵀ)

    A wrench is force [N] and moment [N·m] about the origin of the machine's cuff frame, in its axes. R and p are the
    pose of the arm's cuff frame in the machine's cuff frame; the two frames need not coincide.
    """
    exo = body_poses(assembly.exo, y)
    arm = arm_poses(assembly, z, fit)
    torque = ca.SX.zeros(z.numel())
    for i, pair in enumerate(cuff_pairs(assembly, exo, arm, fit)):
        T, force, moment = pair.T_exo_arm, wrenches[:3, i], wrenches[3:, i]
        torque += ca.jacobian(T.p, z).T @ force
        torque += turning(T.R, z).T @ (moment - ca.cross(T.p, force))
    return torque
