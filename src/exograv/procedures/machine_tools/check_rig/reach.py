"""Reach of the finger tips, and conditioning of the machine's joints."""

from dataclasses import dataclass

import casadi as ca
import numpy as np
from jaxtyping import Float

from exograv.model.assembly import Assembly
from exograv.model.description import RigDescription
from exograv.model.kinematics import body_poses, frame_pose
from exograv.sobol import sobol_points

from .findings import CheckFindings
from .fit import Donned, cuffs_of

VOXEL_M = 0.05
LENGTH_M = 0.3  # a shift by this length counts like a turn by one radian
SINGULAR = 0.1
"""Smallest over largest singular value of the machine's Jacobian below which a posture is singular, as if two axes were
6° apart."""
SAMPLES, SAMPLES_OF_JACOBIAN = 16384, 2048

Points = Float[np.ndarray, "point 3"]
Postures = Float[np.ndarray, "posture joint"]


@dataclass(frozen=True)
class ArmReach:
    """Reach of one arm."""

    side: str
    points: Points
    """Centres of the voxels that the finger tip reaches within the joints' limits, in the base frame [m]."""

    task_points: Float[np.ndarray, "task_point 3"]
    """Centres of the voxels reached within the task workspace [m]."""

    furthest_m: float
    """Largest distance of the finger tip from the shoulder centre [m]."""

    @property
    def volume_m3(self) -> float:
        """Reached volume, by voxels [m³]."""
        return len(self.points) * VOXEL_M**3


@dataclass(frozen=True)
class Conditioning:
    """Smallest over largest singular value of the joints' effect on the cuffs [-]: 0 where a motion is lost."""

    worst: float
    """Smallest value in the task workspace."""

    worst_deg: list[float]
    """Posture of the smallest value [°]."""

    margin_deg: float | None
    """Distance of the nearest singular posture from the task workspace, in the joint that is farthest outside [°]; None
    if there is none within the limits."""

    margin_at_deg: list[float] | None


def box(assembly: Assembly) -> tuple[Float[np.ndarray, " joint"], Float[np.ndarray, " joint"]]:
    """Limits of the joints [rad]; those of an endless joint are -π and π."""
    ends = np.array([(joint.lower, joint.upper) for joint in assembly.exo.joints]).T
    return np.maximum(ends[0], -np.pi), np.minimum(ends[1], np.pi)


def spread(lower: np.ndarray, upper: np.ndarray, count: int) -> Postures:
    """Postures spread evenly over a box [rad]."""
    return lower + sobol_points(len(lower), count) * (upper - lower)


def reach(donned: Donned) -> list[ArmReach]:
    """Reach of the fingertip of each arm, with the arm in the machine as the cuffs were closed."""
    assembly = donned.assembly
    tips = _tips(donned)
    everywhere = _at(tips, spread(*box(assembly), SAMPLES))
    for_the_task = _at(tips, spread(*assembly.description.workspace, SAMPLES // 4))
    found = []
    for limb, all_points, task_points in zip(assembly.arm.limbs, everywhere, for_the_task, strict=True):
        centre = donned.exo_frame(assembly.description.shoulder_centre(limb.side))[1]
        furthest = float(np.linalg.norm(all_points - centre, axis=1).max())
        every_point = np.vstack([all_points, task_points])
        found.append(ArmReach(limb.side, voxels(every_point), voxels(task_points), furthest))
    return found


def voxels(points: Points) -> Float[np.ndarray, "voxel 3"]:
    """Centres of the cubes of `VOXEL_M` that hold a point."""
    return (np.unique(np.floor(points / VOXEL_M), axis=0) + 0.5) * VOXEL_M


def conditioning(assembly: Assembly) -> Conditioning:
    """Return how well the machine can move the cuffs in all directions that its joints allow."""
    jacobian = _jacobian(assembly)
    lower, upper = assembly.description.workspace
    task = np.vstack([spread(lower, upper, SAMPLES_OF_JACOBIAN // 2), _corners(lower, upper)])
    inside = _ratios(jacobian, task)
    everywhere = spread(*box(assembly), SAMPLES_OF_JACOBIAN)
    singular = everywhere[_ratios(jacobian, everywhere) < SINGULAR]
    beyond = np.maximum(np.maximum(lower - singular, singular - upper), 0.0).max(axis=1)
    nearest = int(np.argmin(beyond)) if len(singular) else None
    return Conditioning(
        float(inside.min()),
        _rounded(task[np.argmin(inside)]),
        None if nearest is None else round(float(np.rad2deg(beyond[nearest])), 1),
        None if nearest is None else _rounded(singular[nearest]),
    )


def examine_conditioning(description: RigDescription, found: Conditioning, findings: CheckFindings) -> None:
    """Report a singular posture in the task workspace, in which the machine loses a motion."""
    if found.worst < SINGULAR:
        at = ", ".join(f"{name} {angle:.0f}°" for name, angle in zip(description.joints, found.worst_deg, strict=True))
        findings.problem(
            f"the task workspace holds a nearly singular posture ({at}): conditioning {found.worst:.3f}; allowed: at "
            f"least {SINGULAR}. Two axes coincide there: move the task workspace away from it."
        )


def _tips(donned: Donned) -> ca.Function:
    """Return the function from a posture to the finger tips (3 · arm,), each fixed to its last cuff."""
    assembly = donned.assembly
    y = ca.SX.sym("y", assembly.n)
    poses, points = body_poses(assembly.exo, y), []
    for limb in assembly.arm.limbs:
        frame = cuffs_of(assembly, limb)[-1].exo_frame
        R, p = donned.exo_frame(frame)
        p_cuff_tip = R.T @ (donned.arm_frame(f"{limb.prefix}finger_tip")[1] - p)
        points.append(frame_pose(assembly.exo, poses, frame).apply(ca.SX(ca.DM(p_cuff_tip))))
    return ca.Function("tips", [y], [ca.vertcat(*points)])


def _at(tips: ca.Function, postures: Postures) -> Float[np.ndarray, "arm posture 3"]:
    found = np.array(tips.map(len(postures))(postures.T))
    return found.reshape(-1, 3, len(postures)).transpose(0, 2, 1)


def _jacobian(assembly: Assembly) -> ca.Function:
    """Return the function from a posture to the Jacobian of all cuff poses (12 · cuff, joint)."""
    y = ca.SX.sym("y", assembly.n)
    poses, rows = body_poses(assembly.exo, y), []
    for cuff in assembly.cuffs:
        pose = frame_pose(assembly.exo, poses, cuff.exo_frame)
        # The Frobenius norm of a rotation matrix changes √2 times as fast as the angle.
        rows += [pose.p / LENGTH_M, ca.vec(pose.R) / np.sqrt(2.0)]
    return ca.Function("jacobian", [y], [ca.jacobian(ca.vertcat(*rows), y)])


def _ratios(jacobian: ca.Function, postures: Postures) -> Float[np.ndarray, " posture"]:
    count, n = postures.shape
    stacked = np.array(jacobian.map(count)(postures.T)).reshape(-1, count, n).transpose(1, 0, 2)
    # The eigenvalues of J'J are cheaper than singular values; the ratio that matters is far above rounding.
    values = np.linalg.eigvalsh(stacked.transpose(0, 2, 1) @ stacked)
    return np.sqrt(np.maximum(values[:, 0], 0.0) / np.maximum(values[:, -1], np.finfo(float).tiny))


def _corners(lower: np.ndarray, upper: np.ndarray) -> Postures:
    grids = np.meshgrid(*zip(lower, upper, strict=True))
    return np.stack([grid.ravel() for grid in grids], axis=1)


def _rounded(q: np.ndarray) -> list[float]:
    return np.rad2deg(q).round(1).tolist()
