"""Newton–Euler recursion in jax.numpy, in its usual style: small matrices, unrolled over the joints."""

from typing import Any

import numpy as np

from exograv.dynamics.loop_torque import GRAVITY
from exograv.model.tree import Tree

MOMENTS = np.array([[4, 5, 7], [5, 6, 8], [7, 8, 9]])
"""Indices of the entries of a body's inertia among its ten parameters."""


class Recursion:
    """Inverse dynamics of one tree, as in `dynamics.rnea`."""

    def __init__(self, jnp: Any, tree: Tree):
        self._jnp, self._tree = jnp, tree

    def __call__(self, q: Any, v: Any, a: Any, phi: Any, gravity: Any = GRAVITY) -> Any:
        """Return the torque (joint,) from inertial parameters (joint, 10)."""
        jnp = self._jnp
        rotations, forces, moments, motions = [], [], [], []
        zero = jnp.zeros(3, q.dtype)
        base = zero, zero, -jnp.asarray(gravity, q.dtype)
        for i, joint in enumerate(self._tree.joints):
            omega_p, alpha_p, acc_p = motions[joint.parent] if joint.parent >= 0 else base
            R, p = self._rotation(i, q[i]), jnp.asarray(joint.p_parent_joint, q.dtype)
            axis = jnp.asarray(joint.axis, q.dtype)
            acc = R.T @ (acc_p + jnp.cross(alpha_p, p) + jnp.cross(omega_p, jnp.cross(omega_p, p)))
            omega = R.T @ omega_p
            alpha = R.T @ alpha_p + axis * a[i] + jnp.cross(omega, axis * v[i])
            omega = omega + axis * v[i]
            body = jnp.asarray(phi[i], q.dtype)
            first, inertia = body[1:4], body[MOMENTS]
            forces.append(body[0] * acc + jnp.cross(alpha, first) + jnp.cross(omega, jnp.cross(omega, first)))
            moments.append(inertia @ alpha + jnp.cross(omega, inertia @ omega) + jnp.cross(first, acc))
            rotations.append(R)
            motions.append((omega, alpha, acc))
        return self._backward(rotations, forces, moments, q.dtype)

    def _backward(self, rotations: list[Any], forces: list[Any], moments: list[Any], dtype: Any) -> Any:
        jnp, joints = self._jnp, self._tree.joints
        tau: list[Any] = [0.0] * len(joints)
        for i in reversed(range(len(joints))):
            tau[i] = jnp.asarray(joints[i].axis, dtype) @ moments[i]
            parent = joints[i].parent
            if parent >= 0:
                force = rotations[i] @ forces[i]
                forces[parent] = forces[parent] + force
                lever = jnp.asarray(joints[i].p_parent_joint, dtype)
                moments[parent] = moments[parent] + rotations[i] @ moments[i] + jnp.cross(lever, force)
        return jnp.stack(tau)

    def _rotation(self, i: int, angle: Any) -> Any:
        jnp, joint = self._jnp, self._tree.joints[i]
        x, y, z = joint.axis
        K = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
        R, K_1, K_2 = (jnp.asarray(joint.R_parent_joint @ factor, angle.dtype) for factor in (np.eye(3), K, K @ K))
        return R + jnp.sin(angle) * K_1 + (1 - jnp.cos(angle)) * K_2
