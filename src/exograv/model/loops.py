"""The kinematic loops between exoskeleton and arm: what stretches each cuff, and the posture that stretches least."""

from dataclasses import dataclass

import casadi as ca
import numpy as np
from jaxtyping import Float

from exograv import kernel
from exograv.spatial import Transform, rotation_residual

from .assembly import Assembly
from .kinematics import body_poses, frame_pose

FIT = (
    "shoulder_offset_x",
    "shoulder_offset_y",
    "shoulder_offset_z",
    "glenohumeral_slope",
    "upper_arm_lengthening",
    "cuff_log_stiffness",
    "cuff_log_rotational_stiffness",
)
"""How the arm sits in the machine; zero is as the machine's description and the tape measure have it. Centre of the
wearer's shoulder minus the machine's (base axes) [m]; its migration along up-and-medial per elevation, mean over the
first 90° [m/rad]; upper
arm longer than measured [m]; logarithm of the cuffs' stiffness over `rig.toml`'s, in translation and rotation [-]."""

TWIST_MAX = 1.0
"""Arm and machine differ by at most 0.8 rad in a true rest with 30 mm of offset, by 1.8 rad and more in a false one,
where the arm lies twisted in its cuffs (1600 random starts). Between the two [rad]."""

STAGE = (
    0.1  # rad: of the way from the donning posture; short enough that every start lies in the basin of the next rest
)

ELEVATION_ROUNDING = 0.05  # rad: the elevation of a hanging arm has no direction; rounded so that it has a gradient


def elevation(z: ca.SX) -> ca.SX:
    """Angle between the upper arm and hanging [rad] at arm freedoms z (4,), rounded near zero."""
    cosine = ca.cos(z[0]) * ca.cos(z[1])
    return ca.atan2(ca.sqrt(1 - cosine**2 + ELEVATION_ROUNDING**2), cosine)


def shift_shape(z: ca.SX) -> ca.SX:
    """How far the shoulder centre has shifted at z (4,), in units of its mean slope over the first 90° [rad].

    Source: 12, 25, 39 and 54 mm at 30°, 60°, 90° and 120° are 22.0 θ + 1.83 θ² mm within 0.2 mm (docs/arm.md).
    """
    curvature = 1.83 / 22.0
    theta = elevation(z)
    return theta * (1 + curvature * theta) / (1 + curvature * np.pi / 2)


def arm_positions(z: ca.SX, fit: ca.SX) -> ca.SX:
    """All joint positions of the arm's tree (6,) from its freedoms z (4,): shift and lengthening follow."""
    return ca.vertcat(fit[3] * shift_shape(z), z[:3], fit[4], z[3])


def arm_base(assembly: Assembly, fit: ca.SX) -> Transform:
    """Pose of the arm's root in the machine's base: the machine's shoulder centre plus the wearer's offset."""
    description = assembly.description
    frame = assembly.exo.frame(description.shoulder_centre(description.arm_sides[0]))
    return Transform(ca.SX.eye(3), ca.DM(frame.p_body_frame) + fit[:3])


@dataclass(frozen=True)
class CuffPair:
    """The two frames that one cuff holds together; they coincide where it was fastened."""

    T_world_exo: Transform
    T_world_arm: Transform
    exo_body: int
    """The body of the machine's tree that carries the first."""

    arm_body: int
    """The body of the arm's tree that carries the second."""

    @property
    def T_exo_arm(self) -> Transform:
        """The arm's frame as the machine's sees it: no displacement where the cuff was fastened."""
        return self.T_world_exo.inverse() @ self.T_world_arm


def cuff_pairs(assembly: Assembly, exo: list[Transform], arm: list[Transform], fit: ca.SX) -> list[CuffPair]:
    """All cuffs where the bodies of machine and arm are at `exo` and `arm`.

    Fastened: both trees in the donning posture.
    """
    y_donning = ca.DM(assembly.description.donning_posture)
    exo_donning = body_poses(assembly.exo, ca.SX(y_donning))
    base, tree = arm_base(assembly, fit), assembly.arm.tree
    arm_donning = body_poses(tree, arm_positions(ca.SX(y_donning), fit), base)
    pairs = []
    for cuff in assembly.cuffs:
        T_world_fastened = frame_pose(assembly.exo, exo_donning, cuff.exo_frame)
        T_segment_cuff = frame_pose(tree, arm_donning, cuff.segment, base).inverse() @ T_world_fastened
        pairs.append(
            CuffPair(
                frame_pose(assembly.exo, exo, cuff.exo_frame),
                frame_pose(tree, arm, cuff.segment, base) @ T_segment_cuff,
                assembly.exo.frame(cuff.exo_frame).body,
                tree.frame(cuff.segment).body,
            )
        )
    return pairs


def cuff_residuals(assembly: Assembly, y: ca.SX, z: ca.SX, fit: ca.SX) -> ca.SX:
    """Stretch and twist of all cuffs (6 · cuff,) in the exoskeleton's cuff frames: [m] (3,), then [-] (3,) each."""
    exo = body_poses(assembly.exo, y)
    arm = body_poses(assembly.arm.tree, arm_positions(z, fit), arm_base(assembly, fit))
    rows = []
    for pair in cuff_pairs(assembly, exo, arm, fit):
        rows += [pair.T_exo_arm.p, rotation_residual(pair.T_exo_arm.R)]
    return ca.vertcat(*rows)


def cuff_stiffness(assembly: Assembly) -> Float[np.ndarray, " row"]:
    """Stiffness that belongs to each entry of `cuff_residuals` [N/m] or [N·m/rad]."""
    return np.concatenate([cuff.stiffness for cuff in assembly.cuffs])


def scaled_stiffness(assembly: Assembly, fit: ca.SX) -> ca.SX:
    """The same as learned (row,): translation and rotation each scaled by its factor in `fit`."""
    factors = ca.vertcat(*[ca.exp(fit[5])] * 3, *[ca.exp(fit[6])] * 3)
    return ca.DM(cuff_stiffness(assembly)) * ca.repmat(factors, len(assembly.cuffs), 1)


class LoopSolver:
    """Cold start: the arm's freedoms for a posture of the machine. Not for the tick."""

    def __init__(self, assembly: Assembly):
        self._donning = assembly.description.donning_posture
        y, z, fit = ca.SX.sym("y", assembly.n), ca.SX.sym("z", 4), ca.SX.sym("fit", len(FIT))
        weighted = ca.sqrt(scaled_stiffness(assembly, fit)) * cuff_residuals(assembly, y, z, fit)
        function = ca.Function(
            "loops", [y, z, fit], [weighted, ca.jacobian(weighted, z)], ["y", "z", "fit"], ["residual", "jacobian"]
        )
        self._kernel = kernel.compile(function)

    def solve(
        self,
        y: Float[np.ndarray, " joint"],
        z_start: Float[np.ndarray, " 4"],
        fit: Float[np.ndarray, " 7"] | None = None,
    ) -> tuple[Float[np.ndarray, " 4"], float]:
        """Freedoms z (4,) [rad] of least cuff energy at y (joint,) [rad], and the energy's remaining slope [N·m].

        The cuffs have other rests, with the arm twisted in them. The one meant is that which the arm reaches when the
        machine moves there from the donning posture; a search from `z_start` that ends in another is done again along
        that way, in 5 ms instead of 0.5.
        """
        fit = np.zeros(len(FIT)) if fit is None else fit
        z, slope = self._descend(y, z_start, fit)
        if np.abs(z - y).max() <= TWIST_MAX:
            return z, slope
        way = y - self._donning
        z = self._donning
        for share in np.linspace(0.0, 1.0, 1 + int(np.ceil(np.abs(way).max() / STAGE))):
            z, slope = self._descend(self._donning + share * way, z, fit)
        return z, slope

    def _descend(
        self, y: Float[np.ndarray, " joint"], z_start: Float[np.ndarray, " 4"], fit: Float[np.ndarray, " 7"]
    ) -> tuple[Float[np.ndarray, " 4"], float]:
        """The rest downhill of `z_start`; Levenberg–Marquardt does not diverge where a full Newton step would."""
        from scipy.optimize import least_squares  # 0.1 s that an empty machine does not have to wait for

        result = least_squares(
            lambda z: self._kernel.of(y, z, fit)[0],
            z_start,
            jac=lambda z: self._kernel.of(y, z, fit)[1],  # pyright: ignore[reportArgumentType] - SciPy takes callables
            method="lm",
            xtol=1e-14,
            ftol=1e-14,
            gtol=1e-14,
        )
        return result.x, float(np.abs(result.grad).max())

    def gauss_newton_hessian(
        self,
        y: Float[np.ndarray, " joint"],
        z: Float[np.ndarray, " 4"],
        fit: Float[np.ndarray, " 7"] | None = None,
    ) -> Float[np.ndarray, "4 4"]:
        """Stiffness with which the cuffs hold the arm's freedoms [N·m/rad]."""
        _, jacobian = self._kernel.of(y, z, np.zeros(len(FIT)) if fit is None else fit)
        return jacobian.T @ jacobian
