"""Log-Cholesky coordinates: ten unconstrained numbers that always describe a physically possible body.

Source: Rucker & Wensing 2022, RA-L 7:2771, eq. 10-13.
"""

import casadi as ca
import numpy as np
from jaxtyping import Float

from exograv.model.tree import pseudo_inertia


def phi_from_theta(theta: ca.SX) -> ca.SX:
    """Inertial parameters (10,) from theta = [α, d1, d2, d3, s12, s23, s13, t1, t2, t3] (10,)."""
    alpha, d1, d2, d3, s12, s23, s13, t1, t2, t3 = (theta[i] for i in range(10))
    U = ca.exp(alpha) * ca.vertcat(
        ca.horzcat(ca.exp(d1), s12, s13, t1),
        ca.horzcat(0, ca.exp(d2), s23, t2),
        ca.horzcat(0, 0, ca.exp(d3), t3),
        ca.horzcat(0, 0, 0, 1),
    )
    J = U @ U.T
    trace = J[0, 0] + J[1, 1] + J[2, 2]
    moments = [trace - J[0, 0], -J[0, 1], trace - J[1, 1], -J[0, 2], -J[1, 2], trace - J[2, 2]]
    return ca.vertcat(J[3, 3], J[0, 3], J[1, 3], J[2, 3], *moments)


def theta_from_phi(phi: Float[np.ndarray, " 10"]) -> Float[np.ndarray, " 10"]:
    """Log-Cholesky coordinates of a physically possible body."""
    J = pseudo_inertia(phi)
    # U is upper triangular with J = U Uᵀ: the lower Cholesky factor of J with rows and columns reversed.
    U = np.linalg.cholesky(J[::-1, ::-1])[::-1, ::-1]
    scale = U[3, 3]
    u = U / scale
    return np.array([np.log(scale), *np.log(np.diag(u)[:3]), u[0, 1], u[1, 2], u[0, 2], u[0, 3], u[1, 3], u[2, 3]])
