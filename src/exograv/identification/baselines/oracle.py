"""Offline reference: the most probable physically possible arm, given all samples of a motion at once."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from scipy.linalg import cho_solve, cholesky, solve_triangular

from exograv.identification.core.interface import Estimate, Joints, Parameters, Sample
from exograv.identification.core.physical import PhysicalProjection
from exograv.identification.core.sample_pace import BATCH_PERIOD_S, Averages
from exograv.identification.core.setting import Setting
from exograv.identification.core.whitened_model import PLAUSIBLE_SD, Unknowns, WhitenedModel
from exograv.identification.recursive.recursive import USUAL_SCALES

SAMPLES_MAX = 800
"""Largest number of samples; of a longer motion every second, third, … is used. The noise covariance of each joint
is a full matrix."""

ROUNDS, SETTLED_SD = 8, 0.02
"""Largest number of Gauss–Newton steps, and change below which they end [standard deviations of the prior]."""

GATE = 2.5
"""Residual above which a sample loses weight, as in `recursive` [standard deviations]."""


@dataclass(frozen=True)
class _Rows:
    """Equations y = H ξ + noise of all samples, linearised at one point."""

    y: Float[np.ndarray, "sample joint"]
    H: Float[np.ndarray, "sample joint unknown"]
    told_sd: Float[np.ndarray, "sample joint"]
    """Standard deviation because the direction of motion is uncertain [N·m]."""


class OracleMethod:
    """Offline minimum of ½ rᵀ Σ⁻¹ r + ½ ξᵀξ over possible bodies, x = mean + L ξ (a `Method`).

    The method is an oracle in its algorithm only: it uses all samples and has no time limit, but no access to the
    twin's parameters. Prior, model and noise are those of `recursive`, without its approximations. Σ contains stage 0's
    coloured residual, the wearer's slow torque with the size that explains all residuals best, and the model's
    discrepancy over postures, all as full matrices. Every sample is linearised at the optimum. Each Gauss–Newton step
    is projected onto the cone of positive definite pseudo-inertias in the metric of its covariance. This projection is
    the exact constrained optimum of the step.

    Source: cone: Wensing, Kim, Slotine 2018, RA-L 3:60; weights of outliers: Huber 1964.
    """

    name = "oracle"
    offline = True

    def __init__(self, setting: Setting):
        self._setting, self._model = setting, WhitenedModel(setting)
        self._torque = setting.model
        self._project = PhysicalProjection(setting.bodies, setting.mean)
        self._inverse = np.linalg.pinv(self._model.L)
        self._samples: list[Sample] = []
        self._averages, self._t = Averages(BATCH_PERIOD_S), 0.0
        self._factors: list[Float[np.ndarray, "sample sample"]] = []
        self._done: Estimate | None = None

    def update(self, sample: Sample) -> None:
        """Keep the mean of each 0.08 s."""
        self._t = sample.t
        kept = self._averages.take(sample)
        if kept is not None:
            self._samples.append(kept)
            self._done = None

    def estimate(self) -> Estimate:
        """Return the optimum for all samples so far; takes seconds for a long motion."""
        if self._done is None:
            self._done = self._solved()
        done = self._done
        return Estimate(self._t, done.x.copy(), done.covariance, done.rejected_share, done.noise_scale)

    def cost(self, x: Parameters) -> float:
        """Cost that is minimised, at any parameters, with the noise of the last estimate [-]."""
        xi = self._inverse @ (x - self._model.mean)
        residual = self._linearised(x).y
        parts = [solve_triangular(F, r, lower=True) for F, r in zip(self._factors, residual.T, strict=True)]
        return 0.5 * float(sum(part @ part for part in parts) + xi @ xi)

    def _used(self) -> list[Sample]:
        return self._samples[:: -(-len(self._samples) // SAMPLES_MAX)]

    def _solved(self) -> Estimate:
        xi, scale, rejected = np.zeros(self._model.count), 1.0, 0.0
        x, covariance = self._model.mean, self._setting.covariance
        if not self._samples:
            return Estimate(self._t, x, covariance, 0.0, 1.0)
        held = np.zeros((len(self._used()), self._torque.n_joints))
        for turn in range(ROUNDS):
            near = np.clip(xi, -PLAUSIBLE_SD, PLAUSIBLE_SD)
            rows = self._linearised(self._model.x(near))
            residual = rows.y - rows.H @ (xi - near)
            if 0 < turn < ROUNDS // 2:
                scale, held, rejected = self._noise_of(residual, rows, held)
            self._factors = self._factorised(scale, rows.told_sd, held)
            goal, of_xi = self._step(rows, near)
            covariance = self._model.covariance(of_xi)
            x = self._project(self._model.x(goal), covariance)
            moved, xi = xi, self._inverse @ (x - self._model.mean)
            if turn >= ROUNDS // 2 and np.abs(xi - moved).max() < SETTLED_SD:
                break
        return Estimate(self._t, x, covariance, rejected, scale)

    def _linearised(self, x: Parameters) -> _Rows:
        """Return residual and derivative of each sample at `x`."""
        self._torque.restart()
        y, H, told = [], [], []
        for sample in self._used():
            tau, derivative = self._torque.linearise(sample, x)
            y.append(sample.tau - tau)
            H.append(derivative @ self._model.L)
            told.append(self._torque.direction_uncertainty(sample.v))
        return _Rows(np.array(y), np.array(H), np.array(told))

    def _step(self, rows: _Rows, near: Unknowns) -> tuple[Unknowns, Float[np.ndarray, "unknown unknown"]]:
        """Minimum of the linearised cost without the constraint on bodies, and its covariance."""
        information, slope = np.eye(len(near)), np.zeros(len(near))
        for j, factor in enumerate(self._factors):
            white = solve_triangular(factor, np.column_stack([rows.H[:, j], rows.y[:, j]]), lower=True)
            H, y = white[:, :-1], white[:, -1]
            information += H.T @ H
            slope += H.T @ (y + H @ near)
        covariance = np.linalg.inv(information)
        return covariance @ slope, covariance

    def _noise_of(
        self, residual: Float[np.ndarray, "sample joint"], rows: _Rows, held: Float[np.ndarray, "sample joint"]
    ) -> tuple[float, Float[np.ndarray, "sample joint"], float]:
        """Size of the slow torque that fits the residuals best, noise added to outliers [N·m], share of outliers."""
        best, scale, factors = -np.inf, 1.0, self._factors
        for candidate in USUAL_SCALES:
            trial = self._factorised(float(candidate), rows.told_sd, held)
            likelihood = sum(_log_likelihood(F, r) for F, r in zip(trial, residual.T, strict=True))
            if likelihood > best:
                best, scale, factors = likelihood, float(candidate), trial
        # Leave-one-out error of each residual: its distance from the prediction of all others.
        alone = [cho_solve((F, True), np.eye(len(F))) for F in factors]
        variance = 1.0 / np.column_stack([np.diag(inverse) for inverse in alone])
        off = np.column_stack([inverse @ r for inverse, r in zip(alone, residual.T, strict=True)]) * variance
        surprise = np.abs(off) / np.sqrt(variance)
        added = np.sqrt(np.maximum((off / GATE) ** 2 - variance, 0.0))
        return scale, np.hypot(held, added), float((surprise > 2 * GATE).any(axis=1).mean())

    def _factorised(
        self, scale: float, told_sd: Float[np.ndarray, "sample joint"], held: Float[np.ndarray, "sample joint"]
    ) -> list[Float[np.ndarray, "sample sample"]]:
        """Lower Cholesky factor of the noise covariance of each joint."""
        samples, noise, discrepancy = self._used(), self._setting.noise, self._setting.discrepancy
        t = np.array([sample.t for sample in samples])
        apart = np.abs(t[:, None] - t)
        slow = np.exp(-apart / noise.disturbance_correlation_s)
        errors = (
            None if discrepancy is None else np.array([discrepancy.errors(sample.q, sample.v) for sample in samples])
        )
        factors, sd = [], self._setting.residual_sd
        for j in range(self._torque.n_joints):
            # Exponential correlation with this integrated time, plus 5 % white noise because no sensor is exact.
            own = np.exp(-2.0 * apart / max(noise.correlation_s[j], BATCH_PERIOD_S)) + 0.05 * np.eye(len(t))
            covariance = sd[j] ** 2 * own + (scale * noise.disturbance_sd[j]) ** 2 * slow
            covariance += np.diag(told_sd[:, j] ** 2 + held[:, j] ** 2)
            if errors is not None:
                covariance += errors[:, j] @ errors[:, j].T
            factors.append(np.asarray(cholesky(covariance, lower=True)))
        return factors


def _log_likelihood(factor: Float[np.ndarray, "sample sample"], residual: Joints) -> float:
    """Logarithm of the likelihood of residuals with this covariance, up to a constant."""
    white = solve_triangular(factor, residual, lower=True)
    return -0.5 * float(white @ white) - float(np.log(np.diag(factor)).sum())
