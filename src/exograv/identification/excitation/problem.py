"""Optimisation problem of an excitation motion: figure of merit and limits as functions of basis coefficients."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from jaxtyping import Float

from exograv.identification.core.arm_model import ArmModel
from exograv.identification.core.interface import Parameters

from .basis import Basis, Coefficients
from .information import Criterion, SeenMotion, Statistics
from .limits import MotionLimits
from .regressor import RegressorTrajectory, along

SAMPLES = 80
"""Samples of one period: 0.25 s apart at 20 s, which gives three within the fastest part of the motion."""

GRID_PER_HARMONIC = 16
"""Grid points per harmonic at which the limits are constrained; between them the motion exceeds by 2 % at most."""


@dataclass(frozen=True)
class MotionProblem:
    """Problem of finding the best excitation motion."""

    basis: Basis
    limits: MotionLimits
    model: ArmModel
    x: Parameters
    """Parameters at which the model is linearised."""
    statistics: Statistics
    criterion: Criterion
    passes: Sequence[float]
    """Numbers of periods after which the figure of merit is computed; the problem uses the mean of these figures."""
    start_posture: Float[np.ndarray, " joint"] | None = None
    """Fixed coefficients of the first shape: start and end posture of a piece [rad]; None if they are free."""
    samples: int = SAMPLES

    @property
    def shape(self) -> tuple[int, int]:
        """Shape of the array of coefficients."""
        return self.basis.mixing.shape[1], self.model.n_joints

    @property
    def dt(self) -> float:
        """Time between samples [s]."""
        return self.basis.period_s / self.samples

    def grid(self) -> tuple[list[Float[np.ndarray, "point shape"]], float]:
        """Return the shapes and their two time derivatives at the grid points of the limits, and the overshoot factor.

        Between two grid points the motion is at most this factor larger than at the points.
        """
        points = GRID_PER_HARMONIC * self.basis.harmonics
        tables = self.basis.tables(np.arange(points) * self.basis.period_s / points)
        return list(tables), self.basis.overshoot(points)

    def follow(self, coefficients: Coefficients, *, slopes: bool) -> RegressorTrajectory:
        """Evaluate the model along the motion."""
        q, v, a = (table @ coefficients for table in self.tables())
        return along(self.model, self.x, q, v, a, slopes=slopes)

    def value(self, coefficients: Coefficients, seen: RegressorTrajectory | None = None) -> float:
        """Compute the figure of merit."""
        seen = self.follow(coefficients, slopes=False) if seen is None else seen
        return float(np.mean([self._seen(coefficients, seen).merit(passes)[0] for passes in self.passes]))

    def slope(self, coefficients: Coefficients, seen: RegressorTrajectory) -> tuple[float, Coefficients]:
        """Compute the figure of merit and its gradient with respect to the coefficients."""
        tables = self.tables()
        n, total, by_motion = self.model.n_joints, 0.0, np.zeros((self.samples, 3, self.model.n_joints))
        for passes in self.passes:
            value, by = self._seen(coefficients, seen).merit(passes)
            local = np.einsum("sdjp,sjp->sd", seen.H_by, by.H, optimize=True).reshape(-1, 3, n)
            local[:, 0] += by.q
            local[:, 1] += by.direction_sd * seen.direction_sd_by_v
            total, by_motion = total + value / len(self.passes), by_motion + local / len(self.passes)
        return total, sum((table.T @ by_motion[:, k] for k, table in enumerate(tables)), np.zeros(self.shape))

    def keeps_limits(self, coefficients: Coefficients) -> bool:
        """Return True if machine and person stay within their limits, also between samples."""
        tables, overshoot = self.grid()
        middle = 0.5 * (self.limits.lower + self.limits.upper)
        q, v, a = (table @ coefficients for table in tables)
        if self.limits.broken_by_motion(middle + (q - middle) * overshoot, v * overshoot, a * overshoot).any():
            return False
        seen = self.follow(coefficients, slopes=False)
        return not self.limits.broken_by_arm(seen.z, seen.tau)

    def fitted(self, coefficients: Coefficients) -> Coefficients:
        """Scale and shift a motion until it keeps all limits."""
        coefficients = self.squeezed(coefficients)
        while not self.keeps_limits(coefficients):
            coefficients[1:] *= 0.9
            if self.start_posture is None:
                coefficients[0] += 0.1 * (0.5 * (self.limits.lower + self.limits.upper) - coefficients[0])
            if np.abs(coefficients[1:]).max() < 1e-3:
                break
        return coefficients

    def squeezed(self, coefficients: Coefficients) -> Coefficients:
        """Scale and shift a motion into the limits of posture, speed and acceleration, without limits of the arm."""
        tables, overshoot = self.grid()
        limits, fitted = self.limits, coefficients.copy()
        if self.start_posture is not None:
            fitted[0] = self.start_posture
        way, v, a = (overshoot * table[:, 1:] @ fitted[1:] for table in tables)
        low, high = way.min(axis=0), way.max(axis=0)
        room = (limits.upper - fitted[0], fitted[0] - limits.lower)
        squeeze = np.minimum(limits.v_max / _above(v), limits.a_max / _above(a))
        if self.start_posture is None:
            squeeze = np.minimum(squeeze, (limits.upper - limits.lower) / _above(np.array([high - low])))
        else:
            squeeze = np.minimum(squeeze, np.minimum(room[0] / _above(high[None]), room[1] / _above(low[None])))
        squeeze = np.clip(0.999 * squeeze, 0.0, 1.0)
        fitted[1:] *= squeeze
        if self.start_posture is None:
            low, high = fitted[0] + squeeze * low, fitted[0] + squeeze * high
            fitted[0] += np.maximum(limits.lower - low, 0.0) - np.maximum(high - limits.upper, 0.0)
        return fitted

    def _seen(self, coefficients: Coefficients, seen: RegressorTrajectory) -> SeenMotion:
        return SeenMotion(self.criterion, self.statistics, seen, self.tables()[0] @ coefficients, self.dt)

    def tables(self) -> tuple[Any, Any, Any]:
        """Shapes with two derivatives at the samples."""
        return self.basis.tables(np.arange(self.samples) * self.dt)


def _above(rows: Float[np.ndarray, "point joint"]) -> Float[np.ndarray, " joint"]:
    return np.maximum(np.abs(rows).max(axis=0), 1e-9)
