"""Numbers that a method may move freely: whatever they become, every body stays possible."""

import casadi as ca
import numpy as np
from jaxtyping import Float

from exograv import kernel

from .interface import Covariance, Parameters
from .log_cholesky import phi_from_theta, theta_from_phi

THETA_SD_MAX = 1.0
"""Largest standard deviation of a log-Cholesky number [-, m for t]: a body known so little that its prior, carried over
by the slope at the mean, would allow it to weigh e³⁰ times as much is known to within a factor of about e² instead."""

Coordinate = Float[np.ndarray, " coordinate"]


class Coordinates:
    """Parameters x from c: log-Cholesky numbers of each body, then multiples of the columns of a basis."""

    def __init__(self, bodies: tuple[slice, ...], x: Parameters, basis: Float[np.ndarray, "parameter direction"]):
        """Start at `x`.

        Args:
            bodies: Where the bodies stand in `x`; possible ones.
            x: Where c is zero but for the bodies.
            basis: What one unit of each further coordinate does to `x`; zero for the bodies.
        """
        theta = ca.SX.sym("theta", 10)
        phi = phi_from_theta(theta)
        self._phi = kernel.compile(ca.Function("phi_of_theta", [theta], [phi, ca.jacobian(phi, theta)]))
        self._bodies, self._x, self._basis = bodies, x.copy(), basis
        self._split = 10 * len(bodies)
        thetas = [theta_from_phi(x[body]) for body in bodies]
        self.start: Coordinate = np.concatenate([*thetas, np.zeros(basis.shape[1])])
        """The coordinates of `x`."""

    def at(self, c: Coordinate) -> tuple[Parameters, Float[np.ndarray, "parameter coordinate"]]:
        """Parameters, and their derivative by the coordinates."""
        x = self._x + self._basis @ c[self._split :]
        derivative = np.zeros((len(x), len(c)))
        derivative[:, self._split :] = self._basis
        for i, body in enumerate(self._bodies):
            block = slice(10 * i, 10 * i + 10)
            x[body], derivative[body, block] = self._phi.of(c[block])
        return x, derivative

    def prior(self, covariance: Covariance) -> Float[np.ndarray, "coordinate coordinate"]:
        """Covariance of the coordinates at the start, from that of the bodies; the others' by their basis is one."""
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
