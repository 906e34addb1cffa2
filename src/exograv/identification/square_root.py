"""The recursive filter's arithmetic: a bank of square-root information filters with a coloured disturbance each."""

import numpy as np
from jaxtyping import Float

Joints = Float[np.ndarray, " joint"]

GATE = 2.5
"""Innovation in standard deviations beyond which a measurement loses weight."""


class FilterBank:
    """Constant unknowns ξ ~ N(0, 1) and, per joint, a slow disturbance b, seen through y = H ξ + b + noise.

    The disturbance is an Ornstein–Uhlenbeck process of known correlation time; its size is not known, so one filter
    runs for each assumed size and the data weigh them. Each filter keeps the upper triangle R and the right side r of
    its information: R (ξ, b) = r + unit noise. Updated by QR, so that information never becomes negative.

    `considered` further right sides go through the same updates: what each of so many possible errors of the model
    would do to the estimate (Schmidt's consider covariance). They widen the covariance and leave the mean alone.

    Source: Bierman 1977, Factorization Methods for Discrete Sequential Estimation, ch. VI (square-root information
    filter with process noise).
    """

    def __init__(
        self,
        unknowns: int,
        disturbance_sd: Float[np.ndarray, "filter joint"],
        correlation_s: float,
        considered: int = 0,
    ):
        self._n = unknowns
        self._sd = disturbance_sd
        self._filters, self._joints = disturbance_sd.shape
        self._correlation_s = correlation_s
        size = unknowns + self._joints
        self._R = np.tile(np.eye(size), (self._filters, 1, 1))
        self._r = np.zeros((self._filters, size, 1 + considered))
        rows = 2 * self._joints + size
        self._work = np.zeros((self._filters, rows, self._joints + size + 1 + considered))
        self.log_likelihood = np.zeros(self._filters)
        """How well each assumed size explains the data."""

    def update(
        self,
        dt: float,
        H: Float[np.ndarray, "joint unknown"],
        y: Joints,
        noise_sd: Joints,
        errors: Float[np.ndarray, "joint considered"] | None = None,
    ) -> None:
        """Let `dt` seconds pass, then take one measurement.

        Args:
            dt: Since the last one [s].
            H: Derivative of the measurement with respect to the unknowns.
            y: Measurement.
            noise_sd: Standard deviation of its white noise.
            errors: What each considered error of the model, one standard deviation of it, would add.
        """
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
        last = 2 * k + n
        work[:, k:last, k + n : last] = R_b
        work[:, k:last, last:] = self._r
        weight = 1.0 / noise_sd
        work[:, -k:, k : k + n] = weight[:, None] * H
        work[:, last:, k + n : last] = np.einsum("j,fj,ji->fji", weight, self._sd, np.eye(k))
        work[:, last:, last] = weight * y
        if errors is not None:
            work[:, last:, last + 1 :] = weight[:, None] * errors
        before = _log_determinant(self._R)
        triangle = np.asarray(np.linalg.qr(work, mode="r"))
        self._R = triangle[:, k:last, k:last]
        self._r = triangle[:, k:last, last:]
        after = _log_determinant(triangle[:, :last, :last])
        self.log_likelihood += before - after - 0.5 * triangle[:, last, last] ** 2 + np.log(weight).sum()

    def held_back(
        self, dt: float, H: Float[np.ndarray, "joint unknown"], y: Joints, noise_sd: Joints
    ) -> tuple[Joints, float]:
        """Noise to take a measurement with, so that none moves the estimate by more than `GATE` allows (Huber).

        The noise grows until the surprise is `GATE`. A weight on the noise alone would not hold a burst back: where the
        disturbance is larger than the noise, most of the surprise is believed at any weight.

        Returns:
            Standard deviation of the noise per joint, and the largest surprise before [standard deviations].
        """
        expected, expected_sd = self.predicted(dt, H)
        off = np.abs(y - expected)
        surprise = float((off / np.hypot(expected_sd, noise_sd)).max())
        return np.sqrt(np.maximum(noise_sd**2, (off / GATE) ** 2 - expected_sd**2)), surprise

    @property
    def weights(self) -> Float[np.ndarray, " filter"]:
        """Probability of each assumed size of the disturbance, all equal before the first measurement."""
        likelihood = np.exp(self.log_likelihood - self.log_likelihood.max())
        return likelihood / likelihood.sum()

    def mean(self) -> Float[np.ndarray, " unknown"]:
        """Best unknowns, over all filters."""
        return self.weights @ self._solutions()[:, : self._n, 0]

    def covariance(self) -> Float[np.ndarray, "unknown unknown"]:
        """Of the unknowns, with the spread between the filters and what the considered errors do."""
        weights, all_solutions = self.weights, self._solutions()[:, : self._n]
        solutions, moved = all_solutions[:, :, 0], all_solutions[:, :, 1:]
        spread = solutions - weights @ solutions
        inverse = np.linalg.inv(self._R)[:, : self._n]
        both = np.concatenate([inverse, moved, spread[:, :, None]], axis=2) * np.sqrt(weights)[:, None, None]
        return np.einsum("fij,fkj->ik", both, both, optimize=True)

    def predicted(self, dt: float, H: Float[np.ndarray, "joint unknown"]) -> tuple[Joints, Joints]:
        """Mean and standard deviation of the next measurement without its noise, by the most likely filter."""
        best = int(np.argmax(self.log_likelihood))
        keep = np.exp(-dt / self._correlation_s)
        row = np.hstack([H, np.diag(keep * self._sd[best])])
        mean = row @ np.linalg.solve(self._R[best], self._r[best, :, 0])
        half = np.linalg.solve(self._R[best].T, row.T)
        return mean, np.sqrt((half**2).sum(axis=0) + (1 - keep**2) * self._sd[best] ** 2)

    def _solutions(self) -> Float[np.ndarray, "filter unknown_and_joint side"]:
        return np.linalg.solve(self._R, self._r)


def _log_determinant(triangle: Float[np.ndarray, "filter n n"]) -> Float[np.ndarray, " filter"]:
    return np.log(np.abs(np.diagonal(triangle, axis1=1, axis2=2))).sum(axis=1)
