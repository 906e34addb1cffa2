"""Who listens to an identification's samples beside the method: a held-out check of what it predicts."""

from collections import deque
from collections.abc import Callable

import numpy as np
from jaxtyping import Float

from exograv.identification.core.arm_model import ArmModel
from exograv.identification.core.interface import Parameters, Sample
from exograv.identification.core.sample_pace import BATCH_PERIOD_S, Averages

AHEAD_S = 1.0
"""A sample is predicted by what was known so long before [s]."""
WINDOW_S = 20.0
"""A period of the usual motion: every posture once."""

Joints = Float[np.ndarray, " joint"]


class HeldOutError:
    """Prediction error on samples that had not been used: each is predicted by an estimate from before it."""

    def __init__(self, model: ArmModel, estimate: Callable[[], Parameters]):
        self._model, self._estimate = model, estimate
        self._x = estimate()
        self._renewed, self._averages = -np.inf, Averages(BATCH_PERIOD_S)
        self._errors: deque[tuple[float, Joints]] = deque()

    def __call__(self, sample: Sample) -> None:
        """One sample, before the method takes it."""
        if sample.t - self._renewed > AHEAD_S - 1e-9:
            self._x, self._renewed = self._estimate(), sample.t
        mean = self._averages.take(sample)
        if mean is None:
            return
        expected, _ = self._model.linearise(mean, self._x)
        self._errors.append((mean.t, mean.tau - expected))
        while self._errors[-1][0] - self._errors[0][0] > WINDOW_S:
            self._errors.popleft()

    @property
    def rms(self) -> Joints:
        """Over the last `WINDOW_S` of motion (joint,) [N·m]: noise, the wearer's unrest, and what is wrong."""
        return np.sqrt(np.mean([error**2 for _, error in self._errors], axis=0))

    @property
    def window_s(self) -> float:
        """Motion that it covers [s]."""
        return self._errors[-1][0] - self._errors[0][0]
