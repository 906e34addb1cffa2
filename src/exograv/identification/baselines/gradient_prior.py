"""Gradient descent scaled by the prior covariance: large steps for uncertain parameters, small ones for known."""

from collections.abc import Mapping
from types import MappingProxyType

import numpy as np

from exograv.identification.core.coordinates import Coordinates
from exograv.identification.core.interface import Estimate, Sample
from exograv.identification.core.sample_pace import DESCENT_PERIOD_S, SamplePace
from exograv.identification.core.setting import Setting
from exograv.identification.core.whitened_model import square_root_but

CANDIDATES: tuple[Mapping[str, float], ...] = tuple(
    MappingProxyType({"step": step}) for step in (3e-5, 1e-4, 3e-4, 1e-3, 3e-3, 1e-2, 3e-2, 0.1, 0.3)
)
STEP = 1e-2
"""Step of the descent at 50 Hz, in units of prior covariance [1/(N·m)²]; from python benchmarks/tune_methods.py."""


class GradientPrior:
    """Descent c += step · P₀ Hᵀ R⁻¹ (τ − τ̂), with prior covariance P₀ and noise R of the joints, 1 on average.

    It is a quasi-Newton step with the constant curvature of the prior. c holds the log-Cholesky coordinates of each
    body, so that bodies stay possible, and all other parameters in the prior's scale. It states no uncertainty.
    """

    name = "gradient-prior"

    def __init__(self, setting: Setting, step: float = STEP):
        self._model, self._sd, self._step = setting.model, setting.residual_sd, step
        others = square_root_but(setting.bodies, setting.covariance)
        self._coordinates = Coordinates(setting.bodies, setting.mean, others)
        self._c = self._coordinates.start.copy()
        self._P = self._coordinates.prior(setting.covariance)
        self._pace, self._t = SamplePace(DESCENT_PERIOD_S), 0.0

    def update(self, sample: Sample) -> None:
        """Make one step of the descent, at 50 Hz."""
        self._t = sample.t
        if not self._pace.takes(sample.t):
            return
        x, x_by_c = self._coordinates.at(self._c)
        tau, derivative = self._model.linearise(sample, x)
        variance = (self._sd**2 + self._model.direction_uncertainty(sample.v) ** 2) / np.mean(self._sd**2)
        self._c += self._step * (self._P @ (x_by_c.T @ (derivative.T @ ((sample.tau - tau) / variance))))

    def curvature_at(self, sample: Sample) -> float:
        """Largest eigenvalue of the error's Gauss–Newton Hessian at the start, in the prior's scale [(N·m)²]."""
        x, x_by_c = self._coordinates.at(self._coordinates.start)
        _, derivative = self._model.linearise(sample, x)
        H = derivative @ x_by_c / self._sd[:, None] * np.sqrt(np.mean(self._sd**2))
        return float(np.linalg.eigvalsh(H @ self._P @ H.T)[-1])

    def estimate(self) -> Estimate:
        """Return the current parameters of the descent."""
        return Estimate(self._t, self._coordinates.at(self._c)[0], None, 0.0, 1.0)
