"""The nearest physically possible arm: what least squares may leave, a published estimate may not."""

import casadi as ca
import numpy as np
from jaxtyping import Float
from scipy.optimize import least_squares

from exograv import kernel
from exograv.model.tree import is_physical

from .log_cholesky import phi_from_theta, theta_from_phi

BOUNDARY_SHARE = 0.95  # start this far from the prior towards the edge of what is possible, not on the edge


class PhysicalProjection:
    """Projects the bodies in a parameter vector onto possible ones, in the metric of their covariance.

    The other parameters follow by their covariance with the bodies, as if the bodies had been measured there.
    """

    def __init__(self, bodies: tuple[slice, ...], prior: Float[np.ndarray, " parameter"]):
        self._bodies = bodies
        self._entries = np.concatenate([np.arange(body.start, body.stop) for body in bodies])
        self._prior = prior[self._entries]
        theta = ca.SX.sym("theta", 10)
        phi = phi_from_theta(theta)
        function = ca.Function("phi", [theta], [phi, ca.jacobian(phi, theta)], ["theta"], ["phi", "jacobian"])
        self._phi = kernel.compile(function)

    def is_physical(self, x: Float[np.ndarray, " parameter"]) -> bool:
        """Whether every body is possible."""
        return all(is_physical(x[body]) for body in self._bodies)

    def __call__(
        self, x: Float[np.ndarray, " parameter"], covariance: Float[np.ndarray, "parameter parameter"]
    ) -> Float[np.ndarray, " parameter"]:
        """The possible parameters nearest to `x`; `x` itself where it is possible."""
        if self.is_physical(x):
            return x
        entries = self._entries
        block = covariance[np.ix_(entries, entries)]
        weight = np.linalg.inv(np.linalg.cholesky(block))
        goal = x[entries]
        start = np.concatenate([theta_from_phi(phi) for phi in self._inside(goal)])
        result = least_squares(
            lambda theta: weight @ (self._bodies_of(theta)[0] - goal),
            start,
            jac=lambda theta: weight @ self._bodies_of(theta)[1],
            method="lm",
            max_nfev=100,
        )
        moved, _ = self._bodies_of(result.x)
        projected = x + covariance[:, entries] @ np.linalg.solve(block, moved - goal)
        projected[entries] = moved
        return projected if self.is_physical(projected) else self._clamped(projected)

    def _inside(self, goal: Float[np.ndarray, " n"]) -> list[Float[np.ndarray, " 10"]]:
        """Bodies on the way from the prior to the goal, still possible: the possible ones are a convex cone."""
        bodies = []
        for i in range(0, len(goal), 10):
            share, step = 1.0, goal[i : i + 10] - self._prior[i : i + 10]
            while not is_physical(self._prior[i : i + 10] + share * step):
                share *= BOUNDARY_SHARE
            bodies.append(self._prior[i : i + 10] + BOUNDARY_SHARE * share * step)
        return bodies

    def _clamped(self, x: Float[np.ndarray, " parameter"]) -> Float[np.ndarray, " parameter"]:
        """For a projection that rounding left on the edge."""
        x = x.copy()
        x[self._entries] = np.concatenate(self._inside(x[self._entries]))
        return x

    def _bodies_of(self, theta: Float[np.ndarray, " n"]) -> tuple[np.ndarray, np.ndarray]:
        phi, jacobian = np.zeros(len(theta)), np.zeros((len(theta), len(theta)))
        for i in range(0, len(theta), 10):
            block = slice(i, i + 10)
            phi[block], jacobian[block, block] = self._phi.of(theta[block])
        return phi, jacobian
