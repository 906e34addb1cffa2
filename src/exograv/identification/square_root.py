"""The recursive filter's arithmetic: a bank of square-root information filters with a coloured disturbance each."""

import numpy as np
from jaxtyping import Float

Joints = Float[np.ndarray, " joint"]


class FilterBank:
    """Constant unknowns ξ ~ N(0, 1) and, per joint, a slow disturbance b, seen through y = H ξ + b + noise.

    The disturbance is an Ornstein–Uhlenbeck process of known correlation time; its size is not known, so one filter
    runs for each assumed size and the data weigh them. Each filter keeps the upper triangle R and the right side r of
    its information: R (ξ, b) = r + unit noise. Updated by QR, so that information never becomes negative.

    Source: Bierman 1977, Factorization Methods for Discrete Sequential Estimation, ch. VI (square-root information
    filter with process noise).
    """

    def __init__(self, unknowns: int, disturbance_sd: Float[np.ndarray, "filter joint"], correlation_s: float):
        self._n = unknowns
        self._sd = disturbance_sd
        self._filters, self._joints = disturbance_sd.shape
        self._correlation_s = correlation_s
        size = unknowns + self._joints
        self._R = np.tile(np.eye(size), (self._filters, 1, 1))
        self._r = np.zeros((self._filters, size))
        rows = 2 * self._joints + size
        self._work = np.zeros((self._filters, rows, self._joints + size + 1))
        self.log_likelihood = np.zeros(self._filters)
        """How well each assumed size explains the data."""

    def update(
        self, dt: float, H: Float[np.ndarray, "joint unknown"], y: Joints, noise_sd: Joints
    ) -> None:
        """Let `dt` seconds pass, then take one measurement with white noise of this standard deviation."""
        k, n = self._joints, self._n
        keep = np.exp(-dt / self._correlation_s)
        fresh = np.sqrt(1.0 - keep**2)
        work = self._work
        work[:] = 0.0
        # Columns: fresh noise w (joint), ξ (unknown), b (joint), right side. b_before = (b − fresh·w)/keep.
        work[:, :k, :k] = np.eye(k)
        R_b = self._R[:, :, n:] / keep
        work[:, k : k + n + k, :k] = -fresh * R_b
        work[:, k : k + n + k, k : k + n] = self._R[:, :, :n]
        work[:, k : k + n + k, k + n : -1] = R_b
        work[:, k : k + n + k, -1] = self._r
        weight = 1.0 / noise_sd
        work[:, -k:, k : k + n] = weight[:, None] * H
        work[:, -k:, k + n : -1] = np.einsum("j,fj,ji->fji", weight, self._sd, np.eye(k))
        work[:, -k:, -1] = weight * y
        before = _log_determinant(self._R)
        triangle = np.linalg.qr(work, mode="r")
        self._R = triangle[:, k:-1, k:-1]
        self._r = triangle[:, k:-1, -1]
        after = _log_determinant(triangle[:, :-1, :-1])
        self.log_likelihood += before - after - 0.5 * triangle[:, -1, -1] ** 2 + np.log(weight).sum()

    @property
    def weights(self) -> Float[np.ndarray, " filter"]:
        """Probability of each assumed size of the disturbance, all equal before the first measurement."""
        likelihood = np.exp(self.log_likelihood - self.log_likelihood.max())
        return likelihood / likelihood.sum()

    def mean(self) -> Float[np.ndarray, " unknown"]:
        """Best unknowns, over all filters."""
        return self.weights @ self._solutions()[:, : self._n]

    def covariance(self) -> Float[np.ndarray, "unknown unknown"]:
        """Of the unknowns, with the spread between the filters."""
        weights, solutions = self.weights, self._solutions()[:, : self._n]
        spread = solutions - weights @ solutions
        inverse = np.linalg.inv(self._R)[:, : self._n]
        return np.einsum("f,fij,fkj->ik", weights, inverse, inverse) + np.einsum("f,fi,fk->ik", weights, spread, spread)

    def predicted(self, dt: float, H: Float[np.ndarray, "joint unknown"]) -> tuple[Joints, Joints]:
        """Mean and standard deviation of the next measurement without its noise, by the most likely filter."""
        best = int(np.argmax(self.log_likelihood))
        keep = np.exp(-dt / self._correlation_s)
        row = np.hstack([H, np.diag(keep * self._sd[best])])
        mean = row @ np.linalg.solve(self._R[best], self._r[best])
        half = np.linalg.solve(self._R[best].T, row.T)
        return mean, np.sqrt((half**2).sum(axis=0) + (1 - keep**2) * self._sd[best] ** 2)

    def _solutions(self) -> Float[np.ndarray, "filter unknown_and_joint"]:
        return np.linalg.solve(self._R, self._r[:, :, None])[:, :, 0]


def _log_determinant(triangle: Float[np.ndarray, "filter n n"]) -> Float[np.ndarray, " filter"]:
    return np.log(np.abs(np.diagonal(triangle, axis1=1, axis2=2))).sum(axis=1)
