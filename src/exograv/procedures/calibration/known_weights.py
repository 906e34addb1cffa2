"""Load of a joint by the known weight in its sweep: without load, the torque gain of the joint cannot be measured."""

from dataclasses import dataclass

import casadi as ca
import numpy as np

from exograv.dynamics.loop_torque import GRAVITY
from exograv.model.description import RigDescription
from exograv.model.kinematics import body_poses, frame_pose
from exograv.model.rig_settings import JointSweep
from exograv.model.tree import Tree

LOADED_NM = 0.1
"""Torque of the lightest weight below which scatter of the friction hides it [N·m]."""

VERTICAL = 0.02
"""Sine of the angle to the vertical below which an axis counts as vertical [-]."""

PLACES = 25


@dataclass(frozen=True)
class WeightLoad:
    """Load of a joint by the lightest known weight in its sweep."""

    mount: str
    """Frame at which the weight hangs."""

    tau: float
    """Largest torque [N·m]."""

    is_vertical: bool
    """True if the axis stays vertical, so that no weight loads it."""


def weight_load(description: RigDescription, tree: Tree, sweep: JointSweep) -> WeightLoad:
    """Return the load of a joint by the lightest known weight in its sweep."""
    plan, moving = description.calibration, description.joints.index(sweep.joint)
    mount = sweep.mount or plan.mount
    q = ca.SX.sym("q", len(tree.joints))  # pyright: ignore[reportArgumentType]
    poses = body_poses(tree, q)
    height = frame_pose(tree, poses, mount).p[2]
    torque = -GRAVITY[2] * min(plan.weights_kg) * ca.gradient(height, q)[moving]
    axis = poses[moving].R @ ca.DM(tree.joints[moving].axis)
    found = ca.Function("loads", [q], [torque, ca.norm_2(axis[:2])])
    postures = np.tile(np.deg2rad(sweep.posture_deg), (PLACES, 1))
    postures[:, moving] = np.deg2rad(np.linspace(sweep.from_deg, sweep.to_deg, PLACES))
    torques, tilts = (np.array(one) for one in found(postures.T))
    return WeightLoad(mount, float(np.abs(torques).max()), bool(tilts.max() < VERTICAL))
