"""Observers of an identification's samples: held-out check of the prediction error."""

from collections import deque
from collections.abc import Callable

import numpy as np
from jaxtyping import Float

from exograv.identification.core.arm_model import ArmModel
from exograv.identification.core.interface import Parameters, Sample
from exograv.identification.core.sample_pace import BATCH_PERIOD_S, Averages

AHEAD_S = 1.0
"""Age of the estimate that predicts a sample [s]."""
WINDOW_S = 20.0
"""Duration of the error window [s]: one period of the usual motion, which contains every posture once."""

Joints = Float[np.ndarray, " joint"]


class HeldOutError:
    """Prediction error on unused samples. Each sample is predicted by an estimate from before it."""

    def __init__(self, model: ArmModel, estimate: Callable[[], Parameters]):
        self._model, self._estimate = model, estimate
        self._x = estimate()
        self._renewed, self._averages = -np.inf, Averages(BATCH_PERIOD_S)
        self._errors: deque[tuple[float, Joints]] = deque()

    def __call__(self, sample: Sample) -> None:
        """Take one sample, before the method does."""
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
        """RMS error over the last `WINDOW_S` (joint,) [N·m]: noise, the wearer's unrest, and errors of the estimate."""
        return np.sqrt(np.mean([error**2 for _, error in self._errors], axis=0))

    @property
    def window_s(self) -> float:
        """Duration of the motion in the window [s]."""
        return self._errors[-1][0] - self._errors[0][0]
