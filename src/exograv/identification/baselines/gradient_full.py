"""Plain gradient descent on our model; it separates the effect of the paper's algorithm from that of its model."""

from collections.abc import Mapping
from types import MappingProxyType

from exograv.identification.core.interface import Estimate, Sample
from exograv.identification.core.setting import Setting

from .descent import Descent

CANDIDATES: tuple[Mapping[str, float], ...] = tuple(
    MappingProxyType({"step": step}) for step in (1e-7, 3e-7, 1e-6, 3e-6, 1e-5, 3e-5, 1e-4, 3e-4, 1e-3)
)
STEP = 3e-7
"""Step of the descent at 50 Hz, the same for every parameter [1/(N·m)²]; from python benchmarks/tune_methods.py."""


class GradientFull:
    """Descent of `gradient` that also learns elasticity, misalignment and friction (a `Method`).

    All parameters have the same step length, in their own units, as in plain descent. Bodies are in log-Cholesky
    coordinates, so they stay physically possible. It states no uncertainty.
    """

    def __init__(self, setting: Setting, step: float = STEP, name: str = "gradient-full"):
        self.name = name
        self._descent, self._step = Descent(setting), step

    def update(self, sample: Sample) -> None:
        """Make one step of the descent, at 50 Hz."""
        slope = self._descent.slope(sample)
        if slope is not None:
            self._descent.c -= self._step * slope

    def estimate(self) -> Estimate:
        """Return the current parameters of the descent."""
        return self._descent.estimate()
