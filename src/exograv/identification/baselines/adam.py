"""Adam: gradient descent whose step in each coordinate is scaled by the past gradients of that coordinate."""

from collections.abc import Mapping
from types import MappingProxyType

import numpy as np

from exograv.identification.core.interface import Estimate, Sample
from exograv.identification.core.setting import Setting

from .descent import Descent

CANDIDATES: tuple[Mapping[str, float], ...] = tuple(
    MappingProxyType({"rate": rate}) for rate in (1e-4, 2e-4, 5e-4, 1e-3, 2e-3, 5e-3, 1e-2, 2e-2, 5e-2)
)
RATE = 1e-3
"""Length of a step at 50 Hz, in standard deviations of the prior [-]; python benchmarks/tune_methods.py."""

DECAY_MEAN, DECAY_SQUARE = 0.9, 0.999
TINY = 1e-12
"""Guard against division by zero, relative to the largest mean square [-]; the paper's 1e-8 assumes losses near 1."""


class Adam:
    """Adam on our model, with the same bodies as `gradient-full` (a `Method`); it states no uncertainty.

    Adam moves all parameters by about the same number, and the paper leaves their units to the user. Here the unit is
    the prior's standard deviation; otherwise an offset of millimetres would move as far as a stiffness. The decay rates
    are the paper's.

    Source: Kingma & Ba 2015, ICLR, algorithm 1.
    """

    name = "adam"

    def __init__(self, setting: Setting, rate: float = RATE):
        self._descent, self._rate = Descent(setting), rate
        bodies = np.sqrt(np.diag(self._descent.coordinates.prior(setting.covariance)))[: 10 * len(setting.bodies)]
        loose = setting.learned.copy()
        for body in setting.bodies:
            loose[body] = False
        self._sd = np.concatenate([bodies, np.sqrt(np.diag(setting.covariance))[loose]])
        self._mean, self._square = np.zeros_like(self._sd), np.zeros_like(self._sd)
        self._steps = 0

    def update(self, sample: Sample) -> None:
        """Make one step, at 50 Hz."""
        slope = self._descent.slope(sample)
        if slope is None:
            return
        slope = self._sd * slope
        self._steps += 1
        self._mean += (1.0 - DECAY_MEAN) * (slope - self._mean)
        self._square += (1.0 - DECAY_SQUARE) * (slope**2 - self._square)
        # Bias correction: both averages start from zero and would be too small at first.
        mean = self._mean / (1.0 - DECAY_MEAN**self._steps)
        square = self._square / (1.0 - DECAY_SQUARE**self._steps)
        largest = square.max()
        if largest > 0.0:
            self._descent.c -= self._rate * self._sd * mean / np.sqrt(square + TINY * largest)

    def estimate(self) -> Estimate:
        """Return the current parameters of the descent."""
        return self._descent.estimate()
