"""Inverse dynamics of one tree: joint torque for a motion, by the recursive Newton–Euler algorithm."""

import casadi as ca

from exograv.model.kinematics import NO_HINGES, Hinges, joint_axis, joint_transforms
from exograv.model.tree import Tree
from exograv.spatial import inertia_matrix


def rnea(tree: Tree, q: ca.SX, v: ca.SX, a: ca.SX, phi: ca.SX, gravity: ca.SX, hinges: Hinges = NO_HINGES) -> ca.SX:
    """Generalised forces (joint,) of a tree: M a + bias, with gravity.

    Args:
        tree: Joints of the tree; its own inertial parameters are not used.
        q: Joint positions (joint,) [rad or m].
        v: Joint velocities (joint,).
        a: Joint accelerations (joint,).
        phi: Inertial parameters (10, body); the result is linear in them.
        gravity: Gravity vector (3,) in the base frame [m/s²]; (0, 0, −9.81) if z is up.
        hinges: Oblique hinges of the tree.

    Returns:
        Force along each joint axis that the motors must give [N·m or N].

    Source: Featherstone 2008, Rigid Body Dynamics Algorithms, table 5.1, written with three-dimensional vectors.
    """
    transforms = joint_transforms(tree, q, hinges)
    axes = [joint_axis(tree, i, hinges) for i in range(len(tree.joints))]
    n = len(tree.joints)
    forces, moments = _body_wrenches(tree, transforms, axes, v, a, phi, gravity)
    tau = [ca.SX(0)] * n
    for i in reversed(range(n)):
        joint, T = tree.joints[i], transforms[i]
        tau[i] = ca.dot(axes[i], moments[i] if joint.kind == "revolute" else forces[i])
        if joint.parent >= 0:
            force = T.R @ forces[i]
            forces[joint.parent] += force
            moments[joint.parent] += T.R @ moments[i] + ca.cross(T.p, force)
    return ca.vertcat(*tau)


def _body_wrenches(tree, transforms, axes, v, a, phi, gravity):
    """Force and moment about the body's origin that move each body, in the body's frame."""
    omegas, alphas, accelerations, forces, moments = [], [], [], [], []
    for i, (joint, T) in enumerate(zip(tree.joints, transforms, strict=True)):
        axis = axes[i]
        if joint.parent >= 0:
            omega_p, alpha_p, acc_p = omegas[joint.parent], alphas[joint.parent], accelerations[joint.parent]
        else:
            # An upward acceleration of the base replaces the gravity terms.
            omega_p, alpha_p, acc_p = ca.SX.zeros(3), ca.SX.zeros(3), -gravity
        acc_at_origin = acc_p + ca.cross(alpha_p, T.p) + ca.cross(omega_p, ca.cross(omega_p, T.p))
        omega, alpha, acc = T.R.T @ omega_p, T.R.T @ alpha_p, T.R.T @ acc_at_origin
        if joint.kind == "revolute":
            alpha = alpha + axis * a[i] + ca.cross(omega, axis * v[i])
            omega = omega + axis * v[i]
        else:
            acc = acc + axis * a[i] + 2 * ca.cross(omega, axis * v[i])
        mass, first_moment, inertia = phi[0, i], phi[1:4, i], inertia_matrix(phi[:, i])
        forces.append(mass * acc + ca.cross(alpha, first_moment) + ca.cross(omega, ca.cross(omega, first_moment)))
        moments.append(inertia @ alpha + ca.cross(omega, inertia @ omega) + ca.cross(first_moment, acc))
        omegas.append(omega)
        alphas.append(alpha)
        accelerations.append(acc)
    return forces, moments
