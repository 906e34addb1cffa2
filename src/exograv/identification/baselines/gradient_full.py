"""Plain gradient descent on our model: what of the paper's result is its algorithm, and what its model."""

from collections.abc import Mapping
from types import MappingProxyType

from exograv.identification.core.interface import Estimate, Sample
from exograv.identification.core.setting import Setting

from .descent import Descent

CANDIDATES: tuple[Mapping[str, float], ...] = tuple(
    MappingProxyType({"step": step}) for step in (1e-7, 3e-7, 1e-6, 3e-6, 1e-5, 3e-5, 1e-4, 3e-4, 1e-3)
)
STEP = 3e-7
"""Of the descent, for every parameter alike, at 50 Hz [1/(N·m)²]; python benchmarks/tune_methods.py."""


class GradientFull:
    """`Method`: the descent of `gradient`, with elasticity, misalignment and friction among what it learns.

    One step length for all parameters in their own units, as plain descent has it; bodies by their log-Cholesky
    numbers, so that they stay possible. It states no uncertainty.
    """

    def __init__(self, setting: Setting, step: float = STEP, name: str = "gradient-full"):
        self.name = name
        self._descent, self._step = Descent(setting), step

    def update(self, sample: Sample) -> None:
        """One step downhill, at 50 Hz."""
        slope = self._descent.slope(sample)
        if slope is not None:
            self._descent.c -= self._step * slope

    def estimate(self) -> Estimate:
        """Where the descent is now."""
        return self._descent.estimate()
