"""Arithmetic of the recursive filter: a bank of square-root information filters with coloured disturbances."""

import math

import numpy as np
from jaxtyping import Float
from scipy.linalg import get_lapack_funcs
from scipy.special import logsumexp

Joints = Float[np.ndarray, " joint"]

GATE = 2.5
"""Innovation above which a measurement loses weight [standard deviations]."""

BLOCK_SAMPLES = 50
"""Measurements per QR update in a batch [-]."""

NEGLIGIBLE = 1e-12
"""Weight below which a filter adds nothing to mean and covariance but rounding error [-]."""

REFLECTORS = 12
"""Block size of reflectors in LAPACK [-]; the fastest of 2 to 49 at 51 unknowns."""

# QR of a triangle stacked on rows; application of its reflectors to right sides; triangular solve.
_tpqrt, _tpmqrt, _trtrs = get_lapack_funcs(("tpqrt", "tpmqrt", "trtrs"), dtype=np.float64)


class FilterBank:
    """Bank of filters for constant unknowns ξ ~ N(0, 1) and a slow disturbance b per joint, with y = H ξ + b + noise.

    The disturbance is an Ornstein–Uhlenbeck process with known correlation time. Its size is unknown, so one filter
    runs for each assumed size, and the data weight them. For known ξ, the disturbance of a joint is estimated by a
    scalar Kalman filter. This filter is linear and is applied to each column of (H, y). The normalised innovations of a
    row have unit variance and are uncorrelated. They enter the information of ξ: an upper triangle R and a right side r
    with R ξ = r + unit noise. The QR update keeps the information positive.

    Each joint has `considered` possible model errors. Their effect on the estimate widens the covariance and does not
    change the mean (Schmidt's consider covariance). It is R⁻¹ R⁻ᵀ Σ Hᵀ E, with the whitened rows H of a joint and the
    whitened errors E of the same joint: a sum of products, which costs a tenth of further right sides of the QR update.

    Source: Bierman 1977, Factorization Methods for Discrete Sequential Estimation, ch. V (square-root information
    filter); whitening by the innovations of the noise's own filter after Kailath 1968, IEEE TAC 13:646.
    """

    def __init__(
        self,
        unknowns: int,
        disturbance_sd: Float[np.ndarray, "filter joint"],
        correlation_s: float,
        considered: int = 0,
        prior_sd: Float[np.ndarray, "filter unknown"] | None = None,
    ):
        """Start from the prior.

        Args:
            unknowns: Number of unknowns.
            disturbance_sd: Assumed standard deviation of the slow disturbance.
            correlation_s: Correlation time of the slow disturbance [s].
            considered: Number of considered model errors per joint.
            prior_sd: Prior standard deviation of each unknown; 1 if None.
        """
        self._n = unknowns
        self._variance = disturbance_sd**2
        self._filters, self._joints = disturbance_sd.shape
        self._correlation_s = correlation_s
        # Transposed: LAPACK works on columns, in place.
        self._R = np.tile(np.eye(unknowns), (self._filters, 1, 1)).transpose(0, 2, 1)
        if prior_sd is not None:
            self._R[:, np.arange(unknowns), np.arange(unknowns)] = 1.0 / prior_sd
        self._r = np.zeros((self._filters, 1, unknowns)).transpose(0, 2, 1)
        self._measured = np.zeros((self._filters, unknowns + 1, self._joints)).transpose(0, 2, 1)
        views = (self._R, self._r, self._measured[:, :, :unknowns], self._measured[:, :, unknowns:])
        self._each = list(zip(*views, strict=True))
        self._block = min(REFLECTORS, unknowns)
        self._slow = SlowDisturbance(self._variance, unknowns + 1 + considered)
        self._effect = np.zeros((self._filters, self._joints, unknowns, considered))
        self._not_added: list[Float[np.ndarray, "filter joint column"]] = []
        """Whitened rows whose products are not in `_effect` yet: they are added when the covariance is asked for."""
        self.log_likelihood = np.zeros(self._filters)
        """Logarithm of the likelihood of the data for each assumed size."""

    def update(
        self,
        dt: float,
        H: Float[np.ndarray, "joint unknown"],
        y: Joints,
        noise_sd: Joints,
        errors: Float[np.ndarray, "joint considered"] | None = None,
    ) -> None:
        """Predict the estimate `dt` seconds ahead, then update it with one measurement.

        Args:
            dt: Time since the last measurement [s].
            H: Derivative of the measurement with respect to the unknowns.
            y: Measurement.
            noise_sd: Standard deviation of the white measurement noise.
            errors: Effect of each joint's considered model errors on its measurement, at one standard deviation.
        """
        rows = self._columns(H, y, errors)
        whitened, spread = self._slow.innovations(self._keep(dt), rows, noise_sd**2)
        self._measured[:] = whitened[:, :, : self._n + 1]
        if self._effect.size:
            self._not_added.append(whitened)
            if len(self._not_added) == BLOCK_SAMPLES:
                self._add_waiting()
        before = _log_determinant(self._R)
        unexplained = np.array([self._absorb(*each) for each in self._each])
        self.log_likelihood += before - _log_determinant(self._R) - np.log(spread).sum(axis=1) - 0.5 * unexplained

    def update_all(
        self,
        dt: Float[np.ndarray, " sample"],
        H: Float[np.ndarray, "sample joint unknown"],
        y: Float[np.ndarray, "sample joint"],
        noise_sd: Float[np.ndarray, "sample joint"],
        errors: Float[np.ndarray, "sample joint considered"] | None = None,
    ) -> None:
        """Take many measurements. Same result as repeated `update` up to rounding, about ten times as fast."""
        n = self._n
        keep = np.exp(-dt / self._correlation_s)
        whitened, total = self._slow.all_innovations(keep, self._columns(H, y, errors), noise_sd**2)
        spreads = 0.5 * np.log(total).sum(axis=(0, 2))
        before = _log_determinant(self._R)
        for f, (R, r, _, _) in enumerate(self._each):
            for block in np.array_split(whitened[:, f, :, : n + 1], max(1, len(dt) // BLOCK_SAMPLES)):
                together = block.reshape(-1, n + 1)
                self.log_likelihood[f] -= 0.5 * self._absorb(R, r, together[:, :n], together[:, n:])
        if self._effect.size:
            self._add_effect(whitened)
        self.log_likelihood += before - _log_determinant(self._R) - spreads

    def _absorb(self, R: np.ndarray, r: np.ndarray, seen: np.ndarray, right: np.ndarray) -> float:
        """Absorb rows into the triangle, in place; return the squared residual that remains unexplained."""
        seen, right = np.asfortranarray(seen), np.asfortranarray(right)
        _, reflectors, scales, _ = _tpqrt(0, self._block, R, seen, overwrite_a=1, overwrite_b=1)
        _, left, _ = _tpmqrt(0, reflectors, scales, r, right, trans="T", overwrite_a=1, overwrite_b=1)
        return float(left[:, 0] @ left[:, 0])

    def held_back(
        self, dt: float, H: Float[np.ndarray, "joint unknown"], y: Joints, noise_sd: Joints
    ) -> tuple[Joints, float]:
        """Noise with which a measurement is taken, so that no outlier moves the estimate by more than `GATE` (Huber).

        The noise is enlarged until the normalised innovation is `GATE`. A weight on the noise alone would not suppress
        a burst: if the disturbance is larger than the noise, most of the innovation is accepted at any weight.

        Returns:
            Standard deviation of the noise per joint, and the largest original innovation [standard deviations].
        """
        expected, expected_sd = self.predicted(dt, H)
        return _gated(y - expected, expected_sd, noise_sd)

    def all_held_back(
        self,
        dt: Float[np.ndarray, " sample"],
        residual: Float[np.ndarray, "sample joint"],
        noise_sd: Float[np.ndarray, "sample joint"],
    ) -> tuple[Float[np.ndarray, "sample joint"], Float[np.ndarray, " sample"]]:
        """Return `held_back` of many measurements, from residuals y − H ξ at known ξ and the most likely size."""
        best = int(np.argmax(self.log_likelihood))
        keep, columns = np.exp(-dt / self._correlation_s).tolist(), zip(residual.T, noise_sd.T, strict=True)
        each = [
            _held_back(keep, of_joint.tolist(), (sd**2).tolist(), stationary)
            for (of_joint, sd), stationary in zip(columns, self._variance[best].tolist(), strict=True)
        ]
        white, surprise = np.array(each).transpose(1, 2, 0)
        return np.sqrt(white), surprise.max(axis=1)

    @property
    def weights(self) -> Float[np.ndarray, " filter"]:
        """Probability of each assumed size of the disturbance; all equal before the first measurement."""
        likelihood = np.exp(self.log_likelihood - self.log_likelihood.max())
        return likelihood / likelihood.sum()

    @property
    def log_evidence(self) -> float:
        """Logarithm of the evidence of all measurements for prior and model, averaged over the assumed sizes."""
        return float(logsumexp(self.log_likelihood) - np.log(self._filters))

    def mean(self) -> Float[np.ndarray, " unknown"]:
        """Mean of the unknowns, averaged over all filters with their weights."""
        return self.weights @ np.array([_solved(R, r[:, 0]) for R, r, _, _ in self._each])

    def covariance(self, considered: float = 1.0) -> Float[np.ndarray, "unknown unknown"]:
        """Covariance of the unknowns, including the spread between filters and the effect of the considered errors.

        `considered`: Size of the considered errors over the one with which they were given [-].
        """
        self._add_waiting()
        weights = self.weights
        counts = np.flatnonzero(weights > NEGLIGIBLE)
        weights, n = weights[counts], self._n
        means = np.array([_solved(self._R[f], self._r[f]) for f in counts])
        inverse = np.array([_solved(self._R[f], np.eye(n)) for f in counts])
        effect = self._effect[counts].transpose(0, 2, 1, 3).reshape(len(counts), n, -1)
        moved = considered * (inverse @ (inverse.transpose(0, 2, 1) @ effect))
        spread = means - np.tensordot(weights, means, axes=1)
        columns = np.sqrt(weights)[:, None, None] * np.concatenate([inverse, moved, spread], axis=2)
        half = columns.transpose(1, 0, 2).reshape(n, -1)
        return half @ half.T

    def _add_waiting(self) -> None:
        if self._not_added:
            self._add_effect(np.array(self._not_added))
            self._not_added.clear()

    def _add_effect(self, whitened: Float[np.ndarray, "sample filter joint column"]) -> None:
        """Add the products of rows and considered errors of these samples."""
        by_joint = whitened.transpose(1, 2, 0, 3)
        self._effect += by_joint[..., : self._n].swapaxes(-1, -2) @ by_joint[..., self._n + 1 :]

    def predicted(self, dt: float, H: Float[np.ndarray, "joint unknown"]) -> tuple[Joints, Joints]:
        """Mean and standard deviation of the next noise-free measurement, by the most likely filter."""
        best = int(np.argmax(self.log_likelihood))
        slow, variance = self._slow.predicted(self._keep(dt))
        slow = slow[best]
        half = _solved(self._R[best], (H - slow[:, : self._n]).T, transposed=True)
        mean = slow[:, self._n] + half.T @ self._r[best, :, 0]
        return mean, np.sqrt((half**2).sum(axis=0) + variance[best])

    def _keep(self, dt: float) -> float:
        return float(np.exp(-dt / self._correlation_s))

    def _columns(self, H: np.ndarray, y: np.ndarray, errors: np.ndarray | None) -> np.ndarray:
        if errors is None:
            errors = np.zeros((*y.shape, self._effect.shape[-1]))
        return np.concatenate([H, y[..., None], errors], axis=-1)


class SlowDisturbance:
    """Scalar Kalman filters of the disturbance, one per filter and joint, applied to all columns at once."""

    def __init__(self, variance: Float[np.ndarray, "filter joint"], columns: int):
        self._stationary = variance
        self._variance = variance.copy()
        self._mean = np.zeros((*variance.shape, columns))

    def predicted(
        self, keep: float
    ) -> tuple[Float[np.ndarray, "filter joint column"], Float[np.ndarray, "filter joint"]]:
        """Mean and variance after one step in which the share `keep` of the mean persists."""
        return keep * self._mean, keep**2 * self._variance + (1.0 - keep**2) * self._stationary

    def innovations(
        self, keep: float, rows: Float[np.ndarray, "joint column"], noise_variance: Joints
    ) -> tuple[Float[np.ndarray, "filter joint column"], Float[np.ndarray, "filter joint"]]:
        """Normalised innovations of the rows, and their standard deviation."""
        whitened, total = self.all_innovations(np.array([keep]), rows[None], noise_variance[None])
        return whitened[0], np.sqrt(total[0])

    def all_innovations(
        self,
        keep: Float[np.ndarray, " sample"],
        rows: Float[np.ndarray, "sample joint column"],
        noise_variance: Float[np.ndarray, "sample *filter joint"],
    ) -> tuple[Float[np.ndarray, "sample filter joint column"], Float[np.ndarray, "sample filter joint"]]:
        """Normalised innovations of several samples in order, and their variances."""
        totals = np.empty((len(keep), *self._variance.shape))
        whitened = np.empty((*totals.shape, rows.shape[-1]))
        mean, variance = self._mean, self._variance
        for k, (kept, row, noise, left) in enumerate(zip(keep.tolist(), rows, noise_variance, whitened, strict=True)):
            mean *= kept
            variance = kept**2 * variance + (1.0 - kept**2) * self._stationary
            totals[k] = total = variance + noise
            np.subtract(row, mean, out=left)
            gain = variance / total
            mean += gain[:, :, None] * left
            variance = gain * noise
        self._variance = variance
        whitened /= np.sqrt(totals)[..., None]
        return whitened, totals


def _held_back(
    keep: list[float], residual: list[float], noise_variance: list[float], stationary: float
) -> tuple[list[float], list[float]]:
    """Variance of the noise with which each sample of one joint is taken, and its original innovation.

    On one joint's numbers in order, plain Python takes a fifth of the time of NumPy.
    """
    mean, variance, whites, surprises = 0.0, stationary, list[float](), list[float]()
    for kept, value, noise in zip(keep, residual, noise_variance, strict=True):
        mean, variance = kept * mean, kept * kept * variance + (1.0 - kept * kept) * stationary
        off = value - mean
        surprises.append(abs(off) / math.sqrt(variance + noise))
        white = max(noise, (off / GATE) ** 2 - variance)
        gain = variance / (variance + white)
        mean, variance = mean + gain * off, gain * white
        whites.append(white)
    return whites, surprises


def _gated(off: Joints, expected_sd: Joints, noise_sd: Joints) -> tuple[Joints, float]:
    """Noise enlarged until the normalised innovation is `GATE`, and the largest original innovation."""
    surprise = float((np.abs(off) / np.hypot(expected_sd, noise_sd)).max())
    return np.sqrt(np.maximum(noise_sd**2, (off / GATE) ** 2 - expected_sd**2)), surprise


def square_root(
    covariance: Float[np.ndarray, "parameter parameter"],
) -> Float[np.ndarray, "parameter unknown"]:
    """Factor L with L Lᵀ = covariance; the covariance is scaled first so that small units do not look singular."""
    sd = np.sqrt(np.maximum(np.diag(covariance), 0.0))
    scale = np.where(sd > 0.0, sd, 1.0)
    values, vectors = np.linalg.eigh(covariance / np.outer(scale, scale))
    keep = values > 1e-12
    return scale[:, None] * vectors[:, keep] * np.sqrt(values[keep])


def _solved(triangle: np.ndarray, right: np.ndarray, *, transposed: bool = False) -> np.ndarray:
    """Solution x of triangle · x = right, or of triangleᵀ · x = right."""
    return _trtrs(triangle, right, trans=int(transposed))[0]


def _log_determinant(triangle: Float[np.ndarray, "filter n n"]) -> Float[np.ndarray, " filter"]:
    return np.log(np.abs(np.diagonal(triangle, axis1=1, axis2=2))).sum(axis=1)
