"""Recursive least squares that forgets: old samples count less and less, so that the estimate can follow."""

from collections.abc import Mapping
from types import MappingProxyType

import numpy as np

from .interface import Estimate, Sample
from .pace import DESCENT_PERIOD_S, Pace
from .setting import Setting
from .whitened import Whitened

CANDIDATES: tuple[Mapping[str, float], ...] = tuple(
    MappingProxyType({"memory_s": memory_s}) for memory_s in (2.0, 5.0, 10.0, 20.0, 40.0, 80.0, 160.0, 320.0, np.inf)
)
MEMORY_S = 80.0
"""Age at which a sample counts 1/e [s]; python benchmarks/tune_methods.py."""


class Forgetting:
    """`Method`: K = P Hᵀ (λ R + H P Hᵀ)⁻¹, x += K (τ − τ̂), P = (P − K H P) / λ, every 0.01 s.

    λ = exp(−period/memory). It starts from the prior covariance, not from a large multiple of one, and R is stage 0's,
    white as the method believes: its covariance is that of white noise. Samples are linearised when they come, and
    never again. What it publishes is not projected, as the method has no notion of a possible body.

    Source: Ljung 1999, System Identification, ch. 11.2.
    """

    name = "rls"

    def __init__(self, setting: Setting, memory_s: float = MEMORY_S):
        self._model = Whitened(setting)
        self._keep = float(np.exp(-DESCENT_PERIOD_S / memory_s))
        self._xi, self._P = np.zeros(self._model.count), np.eye(self._model.count)
        self._pace, self._t = Pace(DESCENT_PERIOD_S), 0.0

    def update(self, sample: Sample) -> None:
        """One step, at 100 Hz."""
        self._t = sample.t
        if not self._pace.takes(sample.t):
            return
        error, H = self._model.rows(sample, self._xi)
        PH = self._P @ H.T
        gain = np.linalg.solve(self._keep * np.eye(len(error)) + H @ PH, PH.T).T
        self._xi += gain @ error
        self._P = (self._P - gain @ PH.T) / self._keep
        # Rounding would slowly make it lopsided.
        self._P = 0.5 * (self._P + self._P.T)

    def estimate(self) -> Estimate:
        """Where it is now, possible or not."""
        return Estimate(self._t, self._model.x(self._xi), self._model.covariance(self._P), 0.0, 1.0)
