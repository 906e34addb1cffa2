"""Information of a motion in closed form, by the estimator's statistics, with gradients.

    F = P⁻¹ + passes · Σ_j H_jᵀ S_j⁻¹ H_j               information of the unknowns after so many periods
    B = passes² · Σ_j H_jᵀ S_j⁻¹ Φ_j S_j⁻¹ H_j          effect of the field Φ of unmodelled torque
    ratio_j² = tr(A_j (F⁻¹ + F⁻¹ B F⁻¹))                left over of joint j over its target

S contains the residual and the wearer's slow disturbance, which correlates samples within seconds. The field is
considered as in `discrepancy`: a repeated pass through a posture does not reduce its effect.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from scipy.linalg import cho_factor, cho_solve

from exograv.dynamics.machine import CalibratedMachine
from exograv.identification.core.discrepancy import CLOSURE_ERROR_NM, POSTURE_LENGTH_RAD
from exograv.identification.core.interface import Covariance
from exograv.identification.core.left_over import TARGET_NM, LeftOverPrediction
from exograv.identification.core.prior import disturbance_sd
from exograv.identification.core.square_root import square_root
from exograv.model.rig_settings import Place

from .regressor import RegressorTrajectory

Joints = Float[np.ndarray, " joint"]
NORM = 6.0
"""Exponent of the norm of the joints' ratios [-]: close to the maximum, and smooth."""

NOMINAL_RESIDUAL_SD, NOMINAL_REPEAT_S = 0.12, 0.16
"""Residual [N·m] and its correlation time [s], as stage 0 leaves them on the twin's machines."""

CORRELATION_S = 3.0
"""Correlation time of the wearer's slow disturbance, as in `core.noise.Noise` [s]."""


@dataclass(frozen=True)
class Statistics:
    """Statistics of the unexplained torque, as the estimator assumes them."""

    residual_sd: Joints
    """Standard deviation of the residual of stage 0 [N·m]."""

    correlation_s: Joints
    """Correlation time of that residual [s]."""

    disturbance_sd: Joints
    """Standard deviation of the wearer's slow disturbance [N·m]."""

    field_sd: Joints
    """Standard deviation of the discrepancy field [N·m]."""

    @classmethod
    def of(cls, machine: CalibratedMachine, places: Sequence[Place]) -> "Statistics":
        """Statistics of a calibrated machine; joints known only from the data sheet have the usual residual."""
        known = machine.residual_sd > 0.0
        sd = np.where(known, machine.residual_sd, NOMINAL_RESIDUAL_SD)
        repeat = np.where(known, np.maximum(machine.correlation_s, 0.08), NOMINAL_REPEAT_S)
        return cls(sd, repeat, disturbance_sd(places), np.hypot(CLOSURE_ERROR_NM, sd))

    @property
    def white(self) -> Joints:
        """Variance of the residual times its correlation time [N²m²s]."""
        return self.residual_sd**2 * self.correlation_s


@dataclass(frozen=True)
class Slopes:
    """Gradients of a figure of merit with respect to quantities of a motion (sample, joint, …)."""

    H: Float[np.ndarray, "sample joint parameter"]
    direction_sd: Float[np.ndarray, "sample joint"]
    q: Float[np.ndarray, "sample joint"]


Square = Float[np.ndarray, "unknown unknown"]


class LeftOverCriterion:
    """Norm over the joints of predicted left over / target [-]; the largest ratio dominates, and 1 is the target."""

    def __init__(self, prediction: LeftOverPrediction, covariance: Covariance, places: Sequence[Place]):
        self.root = square_root(covariance)
        """Matrix from unit unknowns to parameters."""
        target = np.array([TARGET_NM[place] for place in places])
        self._gram = np.array([self.root.T @ A @ self.root for A in gram(prediction, len(covariance))])
        self._gram /= target[:, None, None] ** 2

    def __call__(self, F: Square, B: Square) -> tuple[float, Square, Square]:
        """Compute the figure of merit at information F and field B, and its gradients with respect to both."""
        P = np.linalg.inv(F)
        ratio = np.sqrt(np.einsum("jik,ki->j", self._gram, P + P @ B @ P))
        value = float((ratio**NORM).sum() ** (1.0 / NORM))
        by_square = 0.5 * ratio ** (NORM - 2.0) * value ** (1.0 - NORM)
        X = P @ np.tensordot(by_square, self._gram, axes=1) @ P
        return value, -(X + X @ B @ P + P @ B @ X), X


class DeterminantCriterion:
    """D-optimality, the usual criterion: volume of the ellipsoid of all parameters, regardless of their effect."""

    def __init__(self, covariance: Covariance):
        self.root = square_root(covariance)

    def __call__(self, F: Square, B: Square) -> tuple[float, Square, Square]:
        """Compute −log det F per unknown, and its gradients; the field B is ignored."""
        return -float(np.linalg.slogdet(F)[1]) / len(F), -np.linalg.inv(F) / len(F), np.zeros_like(B)


Criterion = LeftOverCriterion | DeterminantCriterion


@dataclass(frozen=True)
class SeenMotion:
    """Motion over one period, with the estimator's statistics."""

    criterion: Criterion
    statistics: Statistics
    along: RegressorTrajectory
    q: Float[np.ndarray, "sample joint"]
    dt: float
    """Time between samples [s]."""

    def residual_covariances(self) -> Float[np.ndarray, "joint sample sample"]:
        """Covariance S of the residual of each joint [N²m²]."""
        tick = np.arange(len(self.q))
        slow = np.exp(-np.abs(np.subtract.outer(tick, tick)) * self.dt / CORRELATION_S)
        S = self.statistics.disturbance_sd[:, None, None] ** 2 * slow
        S[:, tick, tick] += (self.statistics.white / self.dt + self.along.direction_sd**2).T
        return S

    def field(self) -> Float[np.ndarray, "joint sample sample"]:
        """Covariance Φ of the discrepancy field of each joint [N²m²]."""
        apart = ((self.q[:, None] - self.q[None]) ** 2).sum(axis=2)
        return self.statistics.field_sd[:, None, None] ** 2 * np.exp(-0.5 * apart / POSTURE_LENGTH_RAD**2)

    def information(self, passes: float) -> tuple[Square, Square]:
        """Information F and field effect B of the unknowns after `passes` periods."""
        H = np.einsum("sjp,pu->jsu", self.along.H, self.criterion.root)
        return self._information(H, _solved(self.residual_covariances(), H), self.field(), passes)

    def merit(self, passes: float) -> tuple[float, Slopes]:
        """Figure of merit after `passes` periods, and its gradients by H, direction uncertainty and posture."""
        H = np.einsum("sjp,pu->jsu", self.along.H, self.criterion.root)
        S, field = self.residual_covariances(), self.field()
        whitened = _solved(S, H)
        value, by_F, by_B = self.criterion(*self._information(H, whitened, field, passes))
        by_F, by_B = passes * by_F, passes**2 * by_B
        moved = _solved(S, field @ whitened)
        by_H = 2.0 * (whitened @ by_F + moved @ by_B)
        by_S = -whitened @ by_F @ whitened.mT - 2.0 * whitened @ by_B @ moved.mT
        by_sd = 2.0 * self.along.direction_sd * np.einsum("jss->sj", by_S)
        pull = (whitened @ by_B @ whitened.mT * field).sum(axis=0) / POSTURE_LENGTH_RAD**2
        by_q = -2.0 * (pull.sum(axis=1)[:, None] * self.q - pull @ self.q)
        return value, Slopes(np.einsum("jsu,pu->sjp", by_H, self.criterion.root), by_sd, by_q)

    def _information(
        self,
        H: Float[np.ndarray, "joint sample unknown"],
        whitened: Float[np.ndarray, "joint sample unknown"],
        field: Float[np.ndarray, "joint sample sample"],
        passes: float,
    ) -> tuple[Square, Square]:
        F = np.eye(H.shape[2]) + passes * (H.mT @ whitened).sum(axis=0)
        return F, passes**2 * (whitened.mT @ field @ whitened).sum(axis=0)


def _solved(
    S: Float[np.ndarray, "joint sample sample"], right: Float[np.ndarray, "joint sample unknown"]
) -> Float[np.ndarray, "joint sample unknown"]:
    return np.array([cho_solve(cho_factor(one), side) for one, side in zip(S, right, strict=True)])


def gram(prediction: LeftOverPrediction, count: int) -> Float[np.ndarray, "joint parameter parameter"]:
    """Matrices A_j with left over² of joint j = tr(A_j · covariance), from the stop rule's own prediction."""
    units = np.eye(count)
    diagonal = np.array([prediction.rms(np.outer(e, e)) ** 2 for e in units])
    A = np.zeros((diagonal.shape[1], count, count))
    relevant = np.flatnonzero(diagonal.max(axis=1) > 0.0)
    for i in relevant:
        A[:, i, i] = diagonal[i]
        for k in relevant[relevant > i]:
            both = units[i] + units[k]
            A[:, i, k] = A[:, k, i] = 0.5 * (prediction.rms(np.outer(both, both)) ** 2 - diagonal[i] - diagonal[k])
    return A
