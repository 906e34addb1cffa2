"""Forecast of the left over after a motion by the method `recursive`; it judges every design."""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from jaxtyping import Float

from exograv.identification import methods
from exograv.identification.core.arm_model import ArmModel
from exograv.identification.core.arm_setting import arm_setting
from exograv.identification.core.discrepancy import Discrepancy
from exograv.identification.core.interface import Covariance, Parameters, Sample
from exograv.identification.core.left_over import LeftOverPrediction
from exograv.identification.recursive.recursive import Recursive
from exograv.motion import Trajectory

from .information import Statistics

STEP_S = 0.16

Joints = Float[np.ndarray, " joint"]


class Forecast:
    """Forecast of the left over during a motion, for one arm in one machine.

    The method's whole uncertainty counts: tissue, slip of the cuffs and path of the shoulder included.
    """

    def __init__(self, model: ArmModel, x: Parameters, covariance: Covariance, statistics: Statistics):
        """Start from a belief; `model` stays with the caller."""
        sd, correlation_s = statistics.residual_sd, statistics.correlation_s
        setting = arm_setting(model.again(), x, covariance, Discrepancy.of_machine(sd))
        noise = replace(setting.noise, sd=sd, correlation_s=correlation_s)
        method = methods.built("recursive", replace(setting, noise=noise))
        assert isinstance(method, Recursive)
        self._method, self._left_over = method, LeftOverPrediction(model, x)

    def left_over(self, path: Trajectory, times: Sequence[float]) -> Mapping[float, Joints]:
        """Predicted left over (joint,) [N·m] after each of `times` [s], in rising order."""
        stride = round(STEP_S / path.dt)
        rows = range(0, len(path), stride)
        motion = [Sample(k * path.dt, path.q[k], path.v[k], path.a[k], np.zeros_like(path.q[k])) for k in rows]
        after = [min(round(t / (stride * path.dt)), len(motion)) for t in times]
        found = self._method.foresee(motion, after)
        return dict(zip(times, map(self._left_over.rms, found), strict=True))
