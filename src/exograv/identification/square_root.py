"""The recursive filter's arithmetic: a bank of square-root information filters with a coloured disturbance each."""

from collections.abc import Iterator

import numpy as np
from jaxtyping import Float
from scipy.linalg import get_lapack_funcs

Joints = Float[np.ndarray, " joint"]

GATE = 2.5
"""Innovation in standard deviations beyond which a measurement loses weight."""

REFLECTORS = 12
"""How many LAPACK applies at once [-]; the quickest of 2 to 49 at 51 unknowns."""

# QR of a triangle with rows below it, its reflections applied to others, and solving with a triangle.
_tpqrt, _tpmqrt, _trtrs = get_lapack_funcs(("tpqrt", "tpmqrt", "trtrs"), dtype=np.float64)


class FilterBank:
    """Constant unknowns ξ ~ N(0, 1) and, per joint, a slow disturbance b, seen through y = H ξ + b + noise.

    The disturbance is an Ornstein–Uhlenbeck process of known correlation time; its size is not known, so one filter
    runs for each assumed size and the data weigh them. Each filter keeps the upper triangle R and the right side r of
    its information: R (b, ξ) = r + unit noise. Updated by QR, so that information never becomes negative. b comes
    first: what time does to it leaves the rows of ξ alone, and most of the triangle stays as it is.

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
        size, sides = self._joints + unknowns, 1 + considered
        # Transposed: LAPACK works on columns, in place.
        self._R = np.tile(np.eye(size), (self._filters, 1, 1)).transpose(0, 2, 1)
        self._r = np.zeros((self._filters, sides, size)).transpose(0, 2, 1)
        self._measured = np.zeros((self._filters, size + sides, self._joints)).transpose(0, 2, 1)
        views = (self._R, self._r, self._measured[:, :, :size], self._measured[:, :, size:])
        self._each = list(zip(*views, strict=True))
        self._block = min(REFLECTORS, size)
        self._passed = np.zeros((self._filters, 2 * self._joints, self._joints + size + sides))
        self._passed[:, : self._joints, : self._joints] = np.eye(self._joints)
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
        self._pass_time(dt)
        k, size = self._joints, self._joints + self._n
        weight, rows = 1.0 / noise_sd, self._measured
        rows[:, :, :k] = weight * self._sd[:, None, :] * np.eye(k)
        rows[:, :, k:size] = weight[:, None] * H
        rows[:, :, size] = weight * y
        rows[:, :, size + 1 :] = 0.0 if errors is None else weight[:, None] * errors
        for R, r, seen, right in self._each:
            # Triangle and measurement to a triangle, with nothing done to the zeros; all in place.
            _, reflectors, scales, _ = _tpqrt(0, self._block, R, seen, overwrite_a=1, overwrite_b=1)
            _tpmqrt(0, reflectors, scales, r, right, trans="T", overwrite_a=1, overwrite_b=1)
        unexplained = (rows[:, :, size] ** 2).sum(axis=1)
        self.log_likelihood += np.log(weight).sum() - _log_determinant(self._R) - 0.5 * unexplained

    def _pass_time(self, dt: float) -> None:
        """From b before to b after, by b_before = (b − fresh·w)/keep with unit noise w."""
        k, size = self._joints, self._joints + self._n
        keep = np.exp(-dt / self._correlation_s)
        fresh = np.sqrt(1.0 - keep**2)
        self.log_likelihood += _log_determinant(self._R)
        # Columns: w, b, ξ, right side.
        work = self._passed
        work[:, k:, k : 2 * k] = self._R[:, :k, :k] / keep
        work[:, k:, :k] = -fresh * work[:, k:, k : 2 * k]
        work[:, k:, 2 * k : k + size] = self._R[:, :k, k:]
        work[:, k:, k + size :] = self._r[:, :k]
        triangle = np.asarray(np.linalg.qr(work, mode="r"))
        self._R[:, :k] = triangle[:, k:, k : k + size]
        self._r[:, :k] = triangle[:, k:, k + size :]
        self.log_likelihood -= _log_determinant(triangle[:, :k, :k])

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
        return self.weights @ np.array([_solved(R, r[:, 0]) for R, r in self._unknown_part()])

    def covariance(self) -> Float[np.ndarray, "unknown unknown"]:
        """Of the unknowns, with the spread between the filters and what the considered errors do."""
        weights = self.weights
        solutions = np.array([_solved(R, r) for R, r in self._unknown_part()])
        means, moved = solutions[:, :, :1], solutions[:, :, 1:]
        inverse = np.array([_solved(R, np.eye(self._n)) for R, _ in self._unknown_part()])
        spread = means - np.tensordot(weights, means, axes=1)
        columns = np.sqrt(weights)[:, None, None] * np.concatenate([inverse, moved, spread], axis=2)
        half = columns.transpose(1, 0, 2).reshape(self._n, -1)
        return half @ half.T

    def predicted(self, dt: float, H: Float[np.ndarray, "joint unknown"]) -> tuple[Joints, Joints]:
        """Mean and standard deviation of the next measurement without its noise, by the most likely filter."""
        best = int(np.argmax(self.log_likelihood))
        keep = np.exp(-dt / self._correlation_s)
        row = np.hstack([np.diag(keep * self._sd[best]), H])
        half = _solved(self._R[best], row.T, transposed=True)
        return half.T @ self._r[best, :, 0], np.sqrt((half**2).sum(axis=0) + (1 - keep**2) * self._sd[best] ** 2)

    def _unknown_part(self) -> Iterator[tuple[np.ndarray, np.ndarray]]:
        """Triangle and right side of ξ alone, filter by filter."""
        return zip(self._R[:, self._joints :, self._joints :], self._r[:, self._joints :], strict=True)


def _solved(triangle: np.ndarray, right: np.ndarray, *, transposed: bool = False) -> np.ndarray:
    """Solution x of triangle · x = right, or of triangleᵀ · x = right."""
    return _trtrs(triangle, right, trans=int(transposed))[0]


def _log_determinant(triangle: Float[np.ndarray, "filter n n"]) -> Float[np.ndarray, " filter"]:
    return np.log(np.abs(np.diagonal(triangle, axis1=1, axis2=2))).sum(axis=1)
