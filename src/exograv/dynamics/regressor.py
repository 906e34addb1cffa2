"""Regressor: matrix of the generalised forces, which are linear in the inertial parameters."""

import casadi as ca

from exograv.model.tree import Tree

from .rnea import rnea


def tree_regressor(tree: Tree, q: ca.SX, v: ca.SX, a: ca.SX, gravity: ca.SX) -> ca.SX:
    """Matrix Y (joint, 10 · body) with `rnea(...)` = Y · phi; arguments as there, phi body after body.

    It is computed by automatic differentiation of the recursion, so that there is only one model.
    """
    phi = ca.SX.sym("phi", 10, len(tree.joints))
    return ca.jacobian(rnea(tree, q, v, a, phi, gravity), ca.vec(phi))
