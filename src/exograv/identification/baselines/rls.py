"""Recursive least squares with exponential forgetting: the weight of samples decreases with their age."""

from collections.abc import Mapping
from types import MappingProxyType

import numpy as np

from exograv.identification.core.interface import Estimate, Sample
from exograv.identification.core.sample_pace import DESCENT_PERIOD_S, SamplePace
from exograv.identification.core.setting import Setting
from exograv.identification.core.whitened_model import WhitenedModel

CANDIDATES: tuple[Mapping[str, float], ...] = tuple(
    MappingProxyType({"memory_s": memory_s, "noise_factor": noise_factor})
    for memory_s in (20.0, 80.0, np.inf)
    for noise_factor in (1e2, 1e3, 1e4)
)
MEMORY_S, NOISE_FACTOR = np.inf, 1e3
"""Age at which the weight of a sample is 1/e [s], and variance of a sample over that of stage 0's residual [-]. The
latter sets the initial P against R, which the textbook leaves to the user; from python benchmarks/tune_methods.py."""


class RecursiveLeastSquares:
    """Method K = P Hᵀ (λ R + H P Hᵀ)⁻¹, x += K (τ − τ̂), P = (P − K H P) / λ, every 0.02 s.

    λ = exp(−period/memory). P starts from the prior covariance, not from a large multiple of the identity. R is a
    multiple of stage 0's variance and assumed white. Each sample is linearised once, when it arrives. Estimates are not
    projected onto possible bodies, because the method has no such constraint.

    Source: Ljung 1999, System Identification, ch. 11.2.
    """

    name = "rls"

    def __init__(self, setting: Setting, memory_s: float = MEMORY_S, noise_factor: float = NOISE_FACTOR):
        self._model = WhitenedModel(setting)
        self._variance = noise_factor
        self._keep = float(np.exp(-DESCENT_PERIOD_S / memory_s))
        self._xi, self._P = np.zeros(self._model.count), np.eye(self._model.count)
        self._pace, self._t = SamplePace(DESCENT_PERIOD_S), 0.0

    def update(self, sample: Sample) -> None:
        """Make one step, at 50 Hz."""
        self._t = sample.t
        if not self._pace.takes(sample.t):
            return
        error, H = self._model.rows(sample, self._xi)
        PH = self._P @ H.T
        gain = np.linalg.solve(self._keep * self._variance * np.eye(len(error)) + H @ PH, PH.T).T
        self._xi += gain @ error
        self._P = (self._P - gain @ PH.T) / self._keep
        # Rounding errors would slowly make P asymmetric.
        self._P = 0.5 * (self._P + self._P.T)

    def estimate(self) -> Estimate:
        """Return the current estimate; its bodies may be physically impossible."""
        return Estimate(self._t, self._model.x(self._xi), self._model.covariance(self._P), 0.0, 1.0)
