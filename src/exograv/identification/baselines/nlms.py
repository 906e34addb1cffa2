"""Normalised least mean squares: each step removes the same share of an equation's error, at any scale."""

from collections.abc import Mapping
from types import MappingProxyType

import numpy as np

from exograv.identification.core.interface import Estimate, Sample
from exograv.identification.core.sample_pace import DESCENT_PERIOD_S, SamplePace
from exograv.identification.core.setting import Setting
from exograv.identification.core.whitened_model import WhitenedModel

CANDIDATES: tuple[Mapping[str, float], ...] = tuple(
    MappingProxyType({"share": share}) for share in (1e-4, 3e-4, 1e-3, 3e-3, 1e-2, 3e-2, 0.1, 0.3, 1.0)
)
SHARE = 0.03
"""Share of an equation's error that a step removes [-], stable from 0 to 2; from python benchmarks/tune_methods.py."""


class Nlms:
    """Method ξ += share · h (y − hᵀξ) / (1 + hᵀh), joint by joint, in the prior's scale x = mean + L ξ.

    The length of h needs a common unit of the parameters, which the method leaves open; ours is the prior's standard
    deviation. The 1 is the variance of the equation's noise in its own unit: a regressor smaller than its noise causes
    no large step. Estimates are not projected onto possible bodies, because the method has no such constraint. It
    states no uncertainty.

    Source: Widrow & Hoff 1960; Nagumo & Noda 1967, IEEE TAC 12:282; regularised form: Haykin, Adaptive Filter Theory.
    """

    name = "nlms"

    def __init__(self, setting: Setting, share: float = SHARE):
        self._model, self._share = WhitenedModel(setting), share
        self._xi = np.zeros(self._model.count)
        self._pace, self._t = SamplePace(DESCENT_PERIOD_S), 0.0

    def update(self, sample: Sample) -> None:
        """Make one step for each joint's equation, at 50 Hz."""
        self._t = sample.t
        if not self._pace.takes(sample.t):
            return
        errors, H = self._model.rows(sample, self._xi)
        before = self._xi.copy()
        for error, h in zip(errors, H, strict=True):
            left = error - h @ (self._xi - before)
            self._xi += self._share * left / (1.0 + h @ h) * h

    def estimate(self) -> Estimate:
        """Return the current parameters; their bodies may be physically impossible."""
        return Estimate(self._t, self._model.x(self._xi), None, 0.0, 1.0)
