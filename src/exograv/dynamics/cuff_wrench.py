"""Torque on the arm's joints from wrenches measured at the cuffs, by virtual work."""

import casadi as ca

from exograv.model.assembly import Assembly
from exograv.model.kinematics import body_poses
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
        torque += _turning(T.R, z).T @ (moment - ca.cross(T.p, force))
    return torque


def _turning(R: ca.SX, z: ca.SX) -> ca.SX:
    """Angular velocity of a rotation R (3, 3) per rate of each entry of z (3, freedom), in the outer frame's axes."""
    by_z = ca.jacobian(ca.vec(R), z)
    turns = []
    for k in range(z.numel()):
        S = ca.reshape(by_z[:, k], 3, 3) @ R.T
        turns.append(ca.vertcat(S[2, 1], S[0, 2], S[1, 0]))
    return ca.horzcat(*turns)
