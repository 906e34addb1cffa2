"""Recursive least squares that forgets: old samples count less and less, so that the estimate can follow."""

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
"""Age at which a sample counts 1/e [s], and by how much the variance of a sample exceeds stage 0's residual [-]: the
start's P against R, which the textbook leaves to the user; python benchmarks/tune_methods.py."""


class RecursiveLeastSquares:
    """`Method`: K = P Hᵀ (λ R + H P Hᵀ)⁻¹, x += K (τ − τ̂), P = (P − K H P) / λ, every 0.02 s.

    λ = exp(−period/memory). P starts from the prior covariance, not from a large multiple of one; R is a multiple of
    stage 0's, white as the method believes. Samples are linearised when they come, and never again. What it publishes
    is not projected, as the method has no notion of a possible body.

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
        """One step, at 50 Hz."""
        self._t = sample.t
        if not self._pace.takes(sample.t):
            return
        error, H = self._model.rows(sample, self._xi)
        PH = self._P @ H.T
        gain = np.linalg.solve(self._keep * self._variance * np.eye(len(error)) + H @ PH, PH.T).T
        self._xi += gain @ error
        self._P = (self._P - gain @ PH.T) / self._keep
        # Rounding would slowly make it lopsided.
        self._P = 0.5 * (self._P + self._P.T)

    def estimate(self) -> Estimate:
        """Where it is now, possible or not."""
        return Estimate(self._t, self._model.x(self._xi), self._model.covariance(self._P), 0.0, 1.0)
