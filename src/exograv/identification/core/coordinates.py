"""Unconstrained coordinates of the parameters: every value of them describes physically possible bodies."""

import casadi as ca
import numpy as np
from jaxtyping import Float

from exograv import kernel

from .interface import Covariance, Parameters
from .log_cholesky import phi_from_theta, theta_from_phi

THETA_SD_MAX = 1.0
"""Largest standard deviation of a log-Cholesky coordinate [-, m for t]. The prior is transformed by the derivative at
the mean. For a wide prior this would allow e³⁰ times the mass; the limit allows a factor of about e²."""

Coordinate = Float[np.ndarray, " coordinate"]


class Coordinates:
    """Map from coordinates c to parameters x: log-Cholesky coordinates of each body, then factors of basis columns."""

    def __init__(self, bodies: tuple[slice, ...], x: Parameters, basis: Float[np.ndarray, "parameter direction"]):
        """Start at `x`.

        Args:
            bodies: Slices of `x` with the inertial parameters of each body, physically possible.
            x: Start. All further coordinates are zero there.
            basis: Change of `x` per unit of each further coordinate; zero in the rows of the bodies.
        """
        theta = ca.SX.sym("theta", 10)
        phi = phi_from_theta(theta)
        self._phi = kernel.compile(ca.Function("phi_of_theta", [theta], [phi, ca.jacobian(phi, theta)]))
        self._bodies, self._x, self._basis = bodies, x.copy(), basis
        self._split = 10 * len(bodies)
        thetas = [theta_from_phi(x[body]) for body in bodies]
        self.start: Coordinate = np.concatenate([*thetas, np.zeros(basis.shape[1])])
        """Coordinates of the start `x`."""

    def at(self, c: Coordinate) -> tuple[Parameters, Float[np.ndarray, "parameter coordinate"]]:
        """Parameters, and their derivative with respect to the coordinates."""
        x = self._x + self._basis @ c[self._split :]
        derivative = np.zeros((len(x), len(c)))
        derivative[:, self._split :] = self._basis
        for i, body in enumerate(self._bodies):
            block = slice(10 * i, 10 * i + 10)
            x[body], derivative[body, block] = self._phi.of(c[block])
        return x, derivative

    def prior(self, covariance: Covariance) -> Float[np.ndarray, "coordinate coordinate"]:
        """Covariance of the coordinates at the start, from that of the parameters; identity for the further ones."""
        P = np.eye(len(self.start))
        if not self._bodies:
            return P
        _, derivative = self.at(self.start)
        entries = np.concatenate([np.arange(body.start, body.stop) for body in self._bodies])
        inverse = np.linalg.inv(derivative[entries, : self._split])
        of_theta = inverse @ covariance[np.ix_(entries, entries)] @ inverse.T
        shrink = np.minimum(THETA_SD_MAX / np.sqrt(np.diag(of_theta)), 1.0)
        P[: self._split, : self._split] = shrink[:, None] * of_theta * shrink
        return P
