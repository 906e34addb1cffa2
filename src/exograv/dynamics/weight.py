"""Weight of a tree: joint torque that carries it at rest, and its derivative with respect to the joint positions.

With M_j the mass from joint j on, h_j its first moment about the joint's origin, a_j the joint's axis and g gravity,

    ∂U/∂q_j      = −g·(a_j × h_j)              (sliding joint: −M_j g·a_j)
    ∂²U/∂q_j∂q_k = −g·(a_k × (a_j × h_j))      for a turning joint k before j, or j itself; the rest by symmetry
"""

from collections.abc import Sequence

import casadi as ca

from exograv.model.kinematics import NO_HINGES, Hinges, joint_axis
from exograv.model.tree import Tree
from exograv.spatial import Transform


def weight(
    tree: Tree, poses: Sequence[Transform], phi: ca.SX, gravity: ca.SX, hinges: Hinges = NO_HINGES
) -> tuple[ca.SX, ca.SX]:
    """Torque (joint,) [N·m or N] that holds the bodies at rest, and its derivative (joint, joint) by the positions.

    Args:
        tree: Joints of the tree.
        poses: Poses of its bodies in the frame of `gravity`.
        phi: Inertial parameters (10, body).
        gravity: Gravity vector (3,) [m/s²].
        hinges: Oblique hinges of the tree.
    """
    n = len(tree.joints)
    torque, stiffness = ca.SX.zeros(n), ca.SX.zeros(n, n)
    mass = [phi[0, i] for i in range(n)]
    axes = [poses[i].R @ joint_axis(tree, i, hinges) for i in range(n)]
    # First moment of the whole subtree about its joint's origin, once its children have been added.
    moment = [poses[i].R @ phi[1:4, i] for i in range(n)]
    for j in reversed(range(n)):
        joint, axis = tree.joints[j], axes[j]
        swing = ca.cross(axis, moment[j]) if joint.kind == "revolute" else mass[j] * axis
        torque[j] = -ca.dot(gravity, swing)
        pull = ca.cross(gravity, swing)
        k = j
        while k >= 0:
            if tree.joints[k].kind == "revolute":
                # −g·(a_k × s) = a_k·(g × s)
                stiffness[j, k] = stiffness[k, j] = ca.dot(axes[k], pull)
            k = tree.joints[k].parent
        if joint.parent >= 0:
            moment[joint.parent] += moment[j] + mass[j] * (poses[j].p - poses[joint.parent].p)
            mass[joint.parent] += mass[j]
    return torque, stiffness
