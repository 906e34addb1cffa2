"""Postures proposed for a machine: closing of the cuffs, and sweeps in which a weight loads each joint."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from scipy.optimize import least_squares

from exograv.model.tree import Tree, Vector
from exograv.sobol import sobol_points

from .geometry import ArmGeometry, Pose

Joints = Float[np.ndarray, " joint"]

OFF_MAX_DEG = 5.0
"""Largest angle of a segment to its direction at donning in a posture that is proposed [°]."""
INSIDE_RAD, DONNING_INSIDE_RAD = np.deg2rad([5.0, 2.0])
"""Distance of proposed postures from the limits of the joints. In many machines the hanging arm is at a limit; at
donning `exograv rig check` allows 3° between arm and machine."""
STARTS, POSTURES, POINTS = 8, 256, 5


@dataclass(frozen=True)
class Sweep:
    """Sweep of one joint with a weight."""

    joint: int
    ends: tuple[float, float]
    """First and last position of the joint [rad]."""
    body: int
    """Body that carries the weight."""
    place: Vector
    """Place of the weight in the body's frame [m]."""


def box(tree: Tree, inside_rad: float) -> tuple[Joints, Joints]:
    """Limits of the joints [rad], with a distance; those of an endless joint are half a turn."""
    lower = np.array([max(joint.lower, -np.pi) for joint in tree.joints])
    upper = np.array([min(joint.upper, np.pi) for joint in tree.joints])
    inside = np.minimum(inside_rad, 0.25 * (upper - lower))
    return lower + inside, upper - inside


def donning_posture(tree: Tree, arms: list[ArmGeometry]) -> Joints | None:
    """Posture [rad] in which the upper arms hang and the forearms point forward; None if the machine has none."""
    poses, (lower, upper) = Pose(tree), box(tree, float(DONNING_INSIDE_RAD))

    def misses(q: Joints) -> Float[np.ndarray, " miss"]:
        parts = [1e-3 * q]  # A freedom that turns neither segment stays at its zero.
        for arm in arms:
            parts.append(poses(q, arm.carrier)[0] @ arm.upper_arm - [0.0, 0.0, -1.0])
            parts.append(poses(q, arm.elbow_body)[0] @ arm.forearm - [1.0, 0.0, 0.0])
        return np.concatenate(parts)

    starts = [
        np.clip(np.zeros(len(lower)), lower, upper),
        *(lower + sobol_points(len(lower), STARTS) * (upper - lower)),
    ]
    found = min((least_squares(misses, start, bounds=(lower, upper)) for start in starts), key=lambda one: one.cost)
    off = np.linalg.norm(misses(found.x)[len(lower) :].reshape(-1, 3), axis=1)
    return found.x if np.rad2deg(off.max()) < OFF_MAX_DEG else None


def sweep_posture(tree: Tree, sweep: Sweep, held: Mapping[int, float]) -> Joints:
    """Posture [rad] in which a weight loads the moving joint most over its sweep.

    `held`: positions [rad] of the joints whose limits are not known, by index.
    """
    poses, (lower, upper) = Pose(tree), box(tree, float(INSIDE_RAD))
    spread = lower + sobol_points(len(lower), POSTURES) * (upper - lower)
    rows = np.vstack([np.clip(np.zeros(len(lower)), lower, upper), spread])
    for i, position in held.items():
        rows[:, i] = position
    moving = sweep.joint
    rows[:, moving] = sweep.ends[0]

    ends = np.repeat(rows[:, None], POINTS, axis=1)
    ends[:, :, moving] = np.linspace(*sweep.ends, POINTS)
    flat = ends.reshape(-1, len(lower))
    (R, p), (R_weight, p_weight) = poses.many(flat, moving), poses.many(flat, sweep.body)
    lever = np.cross(R @ tree.joints[moving].axis, R_weight @ sweep.place + p_weight - p)
    loads = np.abs(lever[:, 2]).reshape(len(rows), POINTS)
    # Both the whole sweep and its weakest point count: a gain is found only where the weight has a lever.
    return rows[int(np.argmax(loads.mean(axis=1) + loads.min(axis=1)))]
