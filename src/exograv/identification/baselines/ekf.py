"""Extended Kalman filter whose state always describes a physically possible arm."""

from collections.abc import Mapping
from types import MappingProxyType

import numpy as np
from jaxtyping import Float

from exograv.identification.core.coordinates import Coordinates
from exograv.identification.core.interface import Covariance, Estimate, Sample
from exograv.identification.core.sample_pace import DESCENT_PERIOD_S, SamplePace
from exograv.identification.core.setting import Setting
from exograv.identification.core.whitened_model import square_root_but

CANDIDATES: tuple[Mapping[str, float], ...] = tuple(
    MappingProxyType({"noise_factor": noise_factor, "drift": drift})
    for noise_factor in (1e3, 1e4, 1e5)
    for drift in (0.0, 1e-2, 5e-2)
)
NOISE_FACTOR, DRIFT = 1e3, 1e-2
"""Variance of a sample over that of stage 0's residual [-], and random walk of the state in one second, in standard
deviations of the prior [-]; from python benchmarks/tune_methods.py."""

GATE = 18.5
"""Squared normalised innovation of four joints that noise exceeds once in a thousand samples [-]."""

GATE_JOINTS = 4


class LogCholeskyFilter:
    """Filter with predict P += Q, update K = P Hᵀ (H P Hᵀ + R)⁻¹, c += K (τ − τ̂), at 50 Hz (a `Method`).

    The state c holds the log-Cholesky coordinates of each body, and all other parameters in the prior's scale. Its
    covariance starts from the table's, transformed by the derivative at the mean. A sample whose innovation exceeds the
    gate is rejected, as in Foster's filter. Foster tunes Q and R by hand; here they are tuned on the training wearers.
    Foster's wrist weights start from a robot's known links, ours from the table. The published covariance is
    transformed back by the derivative at the estimate, and it assumes white noise.

    Source: Foster et al. 2024, arXiv 2405.07901; coordinates: Rucker & Wensing 2022, RA-L 7:2771.
    """

    name = "ekf"

    def __init__(self, setting: Setting, noise_factor: float = NOISE_FACTOR, drift: float = DRIFT):
        self._model, self._sd, self._factor = setting.model, setting.residual_sd, noise_factor
        others = square_root_but(setting.bodies, setting.covariance)
        self._coordinates = Coordinates(setting.bodies, setting.mean, others)
        self._c = self._coordinates.start.copy()
        self._P = self._coordinates.prior(setting.covariance)
        self._wander = drift**2 * DESCENT_PERIOD_S * self._P
        self._pace, self._t = SamplePace(DESCENT_PERIOD_S), 0.0
        self._samples = self._rejected = 0

    def update(self, sample: Sample) -> None:
        """Make one prediction and one update, at 50 Hz."""
        self._t = sample.t
        if not self._pace.takes(sample.t):
            return
        x, x_by_c = self._coordinates.at(self._c)
        tau, derivative = self._model.linearise(sample, x)
        H, innovation = derivative @ x_by_c, sample.tau - tau
        variance = self._factor * self._sd**2 + self._model.direction_uncertainty(sample.v) ** 2
        self._P += self._wander
        PH = self._P @ H.T
        S = H @ PH + np.diag(variance)
        self._samples += 1
        if innovation @ np.linalg.solve(S, innovation) > GATE * max(len(innovation) / GATE_JOINTS, 1.0):
            self._rejected += 1
            return
        self._take(np.linalg.solve(S, PH.T).T, H, innovation, variance)

    def _take(
        self,
        gain: Float[np.ndarray, "coordinate joint"],
        H: Float[np.ndarray, "joint coordinate"],
        innovation: Float[np.ndarray, " joint"],
        variance: Float[np.ndarray, " joint"],
    ) -> None:
        """Update state and covariance in Joseph's form, which keeps the covariance positive despite rounding."""
        self._c += gain @ innovation
        keep = np.eye(len(self._c)) - gain @ H
        self._P = keep @ self._P @ keep.T + (gain * variance) @ gain.T

    def estimate(self) -> Estimate:
        """Return the state as parameters; the coordinates make them physically possible."""
        x, x_by_c = self._coordinates.at(self._c)
        covariance: Covariance = x_by_c @ self._P @ x_by_c.T
        return Estimate(self._t, x, covariance, self._rejected / max(self._samples, 1), 1.0)
