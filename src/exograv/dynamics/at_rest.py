"""Posture in which a machine without torque comes to rest: the least height that its joints allow."""

import casadi as ca
import numpy as np
from jaxtyping import Float

from exograv import kernel
from exograv.model.kinematics import body_poses
from exograv.model.tree import Tree

from .loop_torque import GRAVITY
from .weight import weight

STEPS = 300
SOFTEST = 0.1  # N·m/rad: bounds the step of a joint without weight

Joints = Float[np.ndarray, " joint"]
Postures = Float[np.ndarray, "*posture joint"]


def carrying_torque(tree: Tree, q: Postures) -> Postures:
    """Joint torque [N·m] that carries the tree's own weight at rest at each posture `q` (..., joint) [rad].

    Give many postures at once: each call builds the tree's kernel.
    """
    torque = _weight(tree)
    return np.array([torque.of(posture)[0] for posture in q.reshape(-1, len(tree.joints))]).reshape(q.shape)


def weight_stiffness(tree: Tree, q: Joints) -> Float[np.ndarray, "joint joint"]:
    """Compute the derivative of the torque that carries the tree's own weight by the posture `q` (joint,) [N·m/rad]."""
    return _matrix(_weight(tree).of(q)[1], len(tree.joints))


def hanging_posture(tree: Tree, margin: float) -> Joints:
    """Posture (joint,) [rad] to which the tree sinks by its own weight, `margin` [rad] inside its joints' limits."""
    torque = _weight(tree)
    lower = np.array([joint.lower for joint in tree.joints]) + margin
    upper = np.maximum(np.array([joint.upper for joint in tree.joints]) - margin, lower)
    posture = np.clip(np.zeros(len(lower)), lower, upper)
    for _ in range(STEPS):
        tau, stiffness = torque.of(posture)
        # Row sums bound the curvature, so that no step passes the zero of the torque.
        bound = np.abs(_matrix(stiffness, len(lower))).sum(axis=1)
        posture = np.clip(posture - tau / (bound + SOFTEST), lower, upper)
    return posture


def _matrix(stiffness: np.ndarray, n: int) -> Float[np.ndarray, "joint joint"]:
    """Return the matrix of `n` joints; a kernel returns a single column as a vector."""
    return stiffness.reshape(n, n)


def _weight(tree: Tree) -> kernel.Kernel:
    q, phi = ca.SX.sym("q", len(tree.joints)), ca.SX(ca.DM(tree.phi.T))
    results = list(weight(tree, body_poses(tree, q), phi, ca.SX(ca.DM(GRAVITY))))
    return kernel.compile(ca.Function("weight", [q], results, ["q"], ["tau", "stiffness"]))
