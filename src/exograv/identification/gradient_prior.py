"""Gradient descent in the prior's own scale: far where little is known, hardly where much is."""

from collections.abc import Mapping
from types import MappingProxyType

import numpy as np

from .interface import Estimate, Sample
from .pace import DESCENT_PERIOD_S, Pace
from .physical import PhysicalProjection
from .setting import Setting
from .whitened import Whitened

CANDIDATES: tuple[Mapping[str, float], ...] = tuple(
    MappingProxyType({"step": step}) for step in (1e-7, 3e-7, 1e-6, 3e-6, 1e-5, 3e-5, 1e-4, 3e-4, 1e-3)
)
STEP = 1e-5
"""Of the descent at 50 Hz, in units of prior covariance per noise variance [-]; python benchmarks/tune_methods.py."""


class GradientPrior:
    """`Method`: x += step · P₀ Hᵀ R⁻¹ (τ − τ̂), with the prior covariance P₀ and the noise R of each joint.

    A quasi-Newton step whose curvature is the prior's and never learns; a descent in ξ, x = mean + L ξ, L Lᵀ = P₀. What
    it publishes is projected onto possible bodies in the prior's metric. It states no uncertainty.
    """

    name = "gradient-prior"

    def __init__(self, setting: Setting, step: float = STEP):
        self._model, self._step = Whitened(setting), step
        self._prior = setting.covariance
        self._project = PhysicalProjection(setting.bodies, setting.mean)
        self._xi = np.zeros(self._model.count)
        self._pace, self._t = Pace(DESCENT_PERIOD_S), 0.0

    def update(self, sample: Sample) -> None:
        """One step downhill, at 50 Hz."""
        self._t = sample.t
        if self._pace.takes(sample.t):
            error, H = self._model.rows(sample, self._xi)
            self._xi += self._step * (H.T @ error)

    def estimate(self) -> Estimate:
        """Where the descent is now, and where not possible the possible place nearest to it."""
        return Estimate(self._t, self._project(self._model.x(self._xi), self._prior), None, 0.0, 1.0)
