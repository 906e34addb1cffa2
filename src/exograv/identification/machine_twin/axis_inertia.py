"""Inertia about each joint's axis: rotor and links together, which motion tells better than either of them."""

import casadi as ca
import numpy as np
from jaxtyping import Float

from exograv.dynamics.rnea import rnea
from exograv.identification.calibration.empty_fit import Fit
from exograv.model.tree import Tree

Joints = Float[np.ndarray, " joint"]


def axis_inertia(tree: Tree, fit: Fit) -> tuple[Joints, Joints]:
    """Inertia about each axis with all joints at zero (joint,), and its standard deviation [kg·m²]."""
    layout, joints = fit.prior.layout, len(tree.joints)
    theta = ca.SX.sym("theta", layout.links.stop)
    phi, zero = ca.reshape(theta[layout.links], 10, joints), ca.SX.zeros(joints)
    rows = []
    for joint in range(joints):
        a = ca.SX.zeros(joints)
        a[joint] = 1.0
        rows.append(rnea(tree, zero, zero, a, phi, ca.SX.zeros(3))[joint])
    inertia = ca.vertcat(*rows) + theta[layout.of("rotor")]
    function = ca.Function("axis_inertia", [theta], [inertia, ca.jacobian(inertia, theta)])
    value, slope = (np.asarray(one.full()) for one in function.call([ca.DM(fit.theta)]))
    return value[:, 0], np.sqrt(np.einsum("ju,uv,jv->j", slope, fit.covariance, slope))
