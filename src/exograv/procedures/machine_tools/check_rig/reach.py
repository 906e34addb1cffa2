"""Where the finger tips get to, and where the machine's axes fall together."""

from dataclasses import dataclass

import casadi as ca
import numpy as np
from jaxtyping import Float

from exograv.model.assembly import Assembly
from exograv.model.description import RigDescription
from exograv.model.kinematics import body_poses, frame_pose

from .findings import CheckFindings
from .fit import Donned, cuffs_of

VOXEL_M = 0.05
LENGTH_M = 0.3  # a shift of so much counts like a turn by one radian
SINGULAR = 0.1
"""Smallest over largest singular value of the machine's Jacobian: as if two axes were 6° apart."""
SAMPLES, SAMPLES_OF_JACOBIAN = 16384, 2048

Points = Float[np.ndarray, "point 3"]
Postures = Float[np.ndarray, "posture joint"]


@dataclass(frozen=True)
class ArmReach:
    """Of one arm."""

    side: str
    points: Points
    """Middles of the voxels that the finger tip gets to within the joints' limits, in the base frame [m]."""

    task_points: Float[np.ndarray, "task_point 3"]
    """The same within the task workspace [m]."""

    furthest_m: float
    """Of the finger tip from the shoulder centre [m]."""

    @property
    def volume_m3(self) -> float:
        """By voxels [m³]."""
        return len(self.points) * VOXEL_M**3


@dataclass(frozen=True)
class Conditioning:
    """Smallest over largest singular value of what the joints do to the cuffs: 0 where a motion is lost [-]."""

    worst: float
    """In the task workspace."""

    worst_deg: list[float]
    """Where."""

    margin_deg: float | None
    """How far outside the task workspace the nearest singular posture lies, in the joint that is farthest off; None if
    there is none within the limits."""

    margin_at_deg: list[float] | None


def box(assembly: Assembly) -> tuple[Float[np.ndarray, " joint"], Float[np.ndarray, " joint"]]:
    """Limits of the joints [rad]; an endless one's count as a turn."""
    ends = np.array([(joint.lower, joint.upper) for joint in assembly.exo.joints]).T
    return np.maximum(ends[0], -np.pi), np.minimum(ends[1], np.pi)


def spread(lower: np.ndarray, upper: np.ndarray, count: int) -> Postures:
    """Postures spread evenly over a box [rad]."""
    from scipy.stats import qmc  # 0.3 s that no tick has to wait for

    return lower + qmc.Sobol(len(lower), scramble=False).random(count) * (upper - lower)


def reach(donned: Donned) -> list[ArmReach]:
    """Of each arm; the arm lies in the machine as it was fastened."""
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
    """Middles of the cubes of `VOXEL_M` that hold a point."""
    return (np.unique(np.floor(points / VOXEL_M), axis=0) + 0.5) * VOXEL_M


def conditioning(assembly: Assembly) -> Conditioning:
    """How well the machine can move the cuffs in all the ways that it has joints for."""
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
    """A task workspace must not hold postures in which the machine loses a motion."""
    if found.worst < SINGULAR:
        at = ", ".join(f"{name} {angle:.0f}°" for name, angle in zip(description.joints, found.worst_deg, strict=True))
        findings.problem(
            f"the task workspace holds a nearly singular posture ({at}): conditioning {found.worst:.3f}; allowed: from "
            f"{SINGULAR} on. Two axes fall together there: move the task workspace away from it."
        )


def _tips(donned: Donned) -> ca.Function:
    """Finger tips (3 · arm,) for a posture, each carried along by its last cuff."""
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
    """How places and turns of all cuffs (12 · cuff, joint) follow the joints."""
    y = ca.SX.sym("y", assembly.n)
    poses, rows = body_poses(assembly.exo, y), []
    for cuff in assembly.cuffs:
        pose = frame_pose(assembly.exo, poses, cuff.exo_frame)
        # A rotation's entries change √2 times as fast, taken together, as it turns.
        rows += [pose.p / LENGTH_M, ca.vec(pose.R) / np.sqrt(2.0)]
    return ca.Function("jacobian", [y], [ca.jacobian(ca.vertcat(*rows), y)])


def _ratios(jacobian: ca.Function, postures: Postures) -> Float[np.ndarray, " posture"]:
    count, n = postures.shape
    stacked = np.array(jacobian.map(count)(postures.T)).reshape(-1, count, n).transpose(1, 0, 2)
    # Singular values by the small matrix: the ratio that counts is far above rounding.
    values = np.linalg.eigvalsh(stacked.transpose(0, 2, 1) @ stacked)
    return np.sqrt(np.maximum(values[:, 0], 0.0) / np.maximum(values[:, -1], np.finfo(float).tiny))


def _corners(lower: np.ndarray, upper: np.ndarray) -> Postures:
    grids = np.meshgrid(*zip(lower, upper, strict=True))
    return np.stack([grid.ravel() for grid in grids], axis=1)


def _rounded(q: np.ndarray) -> list[float]:
    return np.rad2deg(q).round(1).tolist()
