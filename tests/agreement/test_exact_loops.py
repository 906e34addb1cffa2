"""Closure with cuffs that hold each freedom exactly once agrees with Pinocchio's closed loop of two rigid trees."""

from collections.abc import Callable
from dataclasses import replace

import casadi as ca
import numpy as np
import pytest
from tests.shoulder_path import FURTHER_PATH

from exograv import kernel
from exograv.dynamics.closure import closure, cuff_energy, newton_step
from exograv.dynamics.loop_torque import GRAVITY, ArmExpression, arm_load
from exograv.model.anthropometry import Body
from exograv.model.assembly import Assembly
from exograv.model.description import load_rig
from exograv.model.loops import FIT, LoopSolver, arm_hinges, arm_positions
from exograv.model.personal import with_hinges
from exograv.model.rig_settings import ArmSide
from exograv.model.support import assemble, refuse_unsupported

WEARER = Body(1.75, 75.0, "male", {"upper_arm": 0.305, "forearm": 0.262})
TOLERANCE = 1e-9  # N·m and -: rounding, amplified by the inverse of the loop's Jacobian
CLOSED = 1e-10  # m and -: Newton's last step
FREE = {"along_N_per_mm": 0.0, "across_N_per_mm": 0.0, "about_limb_Nm_per_deg": 0.0, "about_others_Nm_per_deg": 0.0}
CUFFS = {
    "two sleeves": ({"across_N_per_mm": 4.0}, {"across_N_per_mm": 3.0}),
    "two sleeves, one that does not turn, and a sleeve on the hand": (
        {"across_N_per_mm": 4.0},
        {"across_N_per_mm": 3.0, "about_limb_Nm_per_deg": 0.2},
        {"across_N_per_mm": 2.0},
    ),
    "a point and a twist": ({"about_limb_Nm_per_deg": 0.2}, {"across_N_per_mm": 4.0, "along_N_per_mm": 2.0}),
}
AXES = {
    "flexion first": (0, 1, 2),
    "abduction first": (1, 0, 2),
}
"""Orders of the machine's shoulder axes; the order of the arm's axes stays."""

OFFSET = np.array([0.015, -0.01, 0.008, 0.006, 0.004, 0.0, 0.0, 0.12, 0.08, 0.007, 0.005, *FURTHER_PATH])

RIGS = {kind: "recupera_like_7" if len(cuffs) == 3 else "recupera_like" for kind, cuffs in CUFFS.items()}


def with_cuffs(assembly: Assembly, kind: str) -> Assembly:
    cuffs = zip(assembly.cuffs, CUFFS[kind], strict=True)
    return replace(assembly, cuffs=tuple(cuff.model_copy(update=FREE | held) for cuff, held in cuffs))


def with_axes(assembly: Assembly, order: tuple[int, ...]) -> Assembly:
    joints = assembly.exo.joints
    shoulder = [replace(joints[i], axis=joints[order[i]].axis) for i in range(3)]
    return replace(assembly, exo=replace(assembly.exo, joints=(*shoulder, *joints[3:])))


def compiled(assembly: Assembly) -> kernel.Kernel:
    """Function of one Newton step, then the torque that holds the arm at rest there."""
    cuffs = cuff_energy(assembly)
    n = assembly.n
    y, z, fit = ca.SX.sym("y", n), ca.SX.sym("z", n), ca.SX.sym("fit", len(FIT))
    closed = closure(cuffs, y, newton_step(cuffs, y, z, fit), fit)
    none = ca.SX.zeros(n)
    arm = ArmExpression(ca.SX(ca.DM(assembly.arm.phi)), fit, none, none, none)
    torque = closed.G.T @ arm_load(assembly, arm, cuffs, closed, (y, none, none), GRAVITY)
    return kernel.compile(ca.Function("loop", [y, z, fit], [closed.z, closed.G, closed.strain, torque]))


def joints_function(assembly: Assembly) -> ca.Function:
    """Joint positions of the arm's tree with unit axes, by its freedoms, and their derivative."""
    z = ca.SX.sym("z", assembly.n_freedoms)
    x = arm_positions(assembly.arm, z, ca.SX(ca.DM(OFFSET)))
    return ca.Function("joints", [z], [x, ca.jacobian(x, z)])


class RigidLoop:
    """Both trees in Pinocchio, with the rows that the cuffs hold."""

    def __init__(self, assembly: Assembly, make_pinocchio: Callable, write_urdf: Callable):
        exo, hinges = assembly.exo, arm_hinges(assembly, ca.SX(ca.DM(OFFSET)))
        arm = with_hinges(assembly.arm.tree, hinges)
        self.exo = make_pinocchio(write_urdf(exo, exo.phi), exo.joint_names)
        self.arm = make_pinocchio(write_urdf(arm, arm.phi), arm.joint_names)
        self.base = exo.frame("shoulder_centre").p_body_frame + OFFSET[:3]
        self.limb = assembly.arm.limbs[0]
        self._joints = joints_function(assembly)
        self.rows = [np.flatnonzero(cuff.stiffness) for cuff in assembly.cuffs]
        donning = assembly.description.donning_posture
        self.cuffs = []
        for cuff in assembly.cuffs:
            R_exo, p_exo = self.exo.pose(donning, cuff.exo_frame)
            R_arm, p_arm = self.arm.pose(self.arm_joints(donning), cuff.segment)
            fastened = R_arm.T @ R_exo, R_arm.T @ (p_exo - p_arm - self.base)
            self.cuffs.append((cuff.exo_frame, cuff.segment, *fastened))

    def arm_joints(self, z: np.ndarray) -> np.ndarray:
        return np.array(self._joints(z)[0]).ravel()

    def arm_slopes(self, z: np.ndarray) -> np.ndarray:
        """Derivative of the arm's joint positions by its freedoms (joint, freedom)."""
        return np.array(self._joints(z)[1])

    def residual_and_jacobians(self, y: np.ndarray, z: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Residuals of the held rows of all cuffs, and their derivatives with respect to y and z."""
        x, slopes = self.arm_joints(z), self.arm_slopes(z)
        parts = []
        for (exo_frame, segment, R_segment_cuff, p_segment_cuff), rows in zip(self.cuffs, self.rows, strict=True):
            R_exo, p_exo = self.exo.pose(y, exo_frame)
            R_arm, p_arm = self.arm.pose(x, segment)
            lever = R_arm @ p_segment_cuff
            stretch = self.base + p_arm + lever - p_exo
            Q = R_exo.T @ R_arm @ R_segment_cuff
            of_exo, of_arm = self.exo.jacobian(y, exo_frame), self.arm.jacobian(x, segment) @ slopes
            twist = lambda turn, Q=Q: 0.5 * (np.trace(Q) * np.eye(3) - Q) @ turn  # noqa: E731 - the formula in one line
            in_y = np.vstack(
                [R_exo.T @ (-of_exo[:3] + cross(stretch) @ of_exo[3:]), twist(-R_exo.T @ of_exo[3:])],
            )
            in_z = np.vstack([R_exo.T @ (of_arm[:3] - cross(lever) @ of_arm[3:]), twist(R_exo.T @ of_arm[3:])])
            skewed = 0.5 * (Q - Q.T)
            value = np.array([*(R_exo.T @ stretch), skewed[2, 1], skewed[0, 2], skewed[1, 0]])
            parts.append((value[rows], in_y[rows], in_z[rows]))
        residual, in_y, in_z = (np.concatenate(part) for part in zip(*parts, strict=True))
        return residual, in_y, in_z


def cross(u: np.ndarray) -> np.ndarray:
    """Matrix of the cross product with u."""
    return np.array([[0.0, -u[2], u[1]], [u[2], 0.0, -u[0]], [-u[1], u[0], 0.0]])


@pytest.mark.parametrize("side", ["right", "left"])
@pytest.mark.parametrize("order", AXES)
@pytest.mark.parametrize("kind", CUFFS)
def test_the_arms_torque_is_what_pinocchios_frame_jacobians_map(
    make_pinocchio, write_urdf, kind: str, order: str, side: ArmSide
):
    ours = with_axes(with_cuffs(assemble(load_rig(RIGS[kind], side), WEARER), kind), AXES[order])
    loop, function, solver = RigidLoop(ours, make_pinocchio, write_urdf), compiled(ours), LoopSolver(ours)
    generator = np.random.default_rng(0)
    lower, upper = ours.description.workspace
    for y in generator.uniform(lower + 0.1, upper, (8, ours.n)):
        z, _ = solver.solve(y, fit=OFFSET)
        for _ in range(3):
            z = function.of(y, z, OFFSET)[0]
        z, G, strain, torque = function.of(y, z, OFFSET)
        residual, in_y, in_z = loop.residual_and_jacobians(y, z)
        G_rigid = -np.linalg.solve(in_z, in_y)
        tau_arm = loop.arm_slopes(z).T @ loop.arm.gravity_torque(loop.arm_joints(z))
        np.testing.assert_allclose(residual, 0.0, atol=CLOSED)
        np.testing.assert_allclose(G, G_rigid, atol=TOLERANCE)
        np.testing.assert_allclose(torque, G_rigid.T @ tau_arm, atol=TOLERANCE)
        np.testing.assert_allclose(strain, 0.0, atol=TOLERANCE)


@pytest.mark.parametrize("kind", CUFFS)
def test_cuffs_that_hold_each_freedom_once_are_accepted(kind: str):
    refuse_unsupported(with_cuffs(assemble(load_rig(RIGS[kind]), WEARER), kind))
