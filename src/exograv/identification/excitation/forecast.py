"""Forecast of the left over after a motion by the estimator's own filter; it judges every design."""

from collections.abc import Mapping, Sequence

import numpy as np
from jaxtyping import Float

from exograv.identification.core.arm_model import ArmModel
from exograv.identification.core.discrepancy import FEATURES, POSTURE_LENGTH_RAD, Discrepancy
from exograv.identification.core.interface import Covariance, Parameters, Sample
from exograv.identification.core.left_over import LeftOverPrediction
from exograv.identification.core.square_root import FilterBank, square_root
from exograv.motion import Trajectory

from .information import CORRELATION_S, Statistics

STEP_S = 0.16

Joints = Float[np.ndarray, " joint"]


class Forecast:
    """Forecast of the left over during a motion, for one arm in one machine."""

    def __init__(self, model: ArmModel, x: Parameters, covariance: Covariance, statistics: Statistics):
        self._model, self._x, self._statistics = model, x, statistics
        self._root = square_root(covariance)
        self._left_over = LeftOverPrediction(model, x)
        self._field = Discrepancy(statistics.field_sd, POSTURE_LENGTH_RAD, FEATURES)

    def left_over(self, path: Trajectory, times: Sequence[float]) -> Mapping[float, Joints]:
        """Predicted left over (joint,) [N·m] after each of `times` [s], in rising order."""
        bank = FilterBank(
            self._root.shape[1], self._statistics.disturbance_sd[None, :], CORRELATION_S, self._field.count_of_joint
        )
        self._model.restart()
        stride, found, remaining = round(STEP_S / path.dt), {}, list(times)
        nothing = np.zeros(path.q.shape[1])
        for k in range(0, len(path), stride):
            sample = Sample(k * path.dt, path.q[k], path.v[k], path.a[k], nothing)
            _, derivative = self._model.linearise(sample, self._x)
            white = np.sqrt(self._statistics.white / (stride * path.dt))
            noise = np.hypot(white, self._model.direction_uncertainty(sample.v))
            errors = self._field.errors_of_joint(sample.q, sample.v)
            bank.update(stride * path.dt, derivative @ self._root, nothing, noise, errors)
            while remaining and sample.t + stride * path.dt >= remaining[0] - 1e-9:
                found[remaining.pop(0)] = self._left_over.rms(self._root @ bank.covariance() @ self._root.T)
        return found
