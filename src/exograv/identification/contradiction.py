"""Do the first seconds of motion contradict what is believed about this person? A comparison of two beliefs."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from scipy.linalg import cho_solve, cholesky
from scipy.special import logsumexp

from .discrepancy import Discrepancy
from .interface import Sample, TorqueModel
from .recursive import DISTURBANCE_SCALES, PLAUSIBLE_SD, Noise

LINEARISATIONS = 3
"""Gauss–Newton steps to where a belief and the samples meet; the torque bends with the fit."""

Parameters = Float[np.ndarray, " parameter"]
Covariance = Float[np.ndarray, "parameter parameter"]
Stacked = Float[np.ndarray, " measurement"]


@dataclass(frozen=True)
class Unexplained:
    """What no belief about the arm has to explain."""

    noise: Noise
    discrepancy: Discrepancy | None


def log_evidence(
    belief: tuple[Parameters, Covariance], samples: Sequence[Sample], model: TorqueModel, unexplained: Unexplained
) -> float:
    """Logarithm of the density that a belief gave these samples beforehand, over all sizes of the wearer's unrest.

    Of two beliefs the difference counts: by so much, as a logarithm, the samples speak for the one with more.

    Source: MacKay 2003, Information Theory, Inference and Learning Algorithms, ch. 28 (Laplace's approximation).
    """
    mean, covariance = belief
    sd = np.sqrt(np.diag(covariance))
    tau = np.concatenate([sample.tau for sample in samples])
    evidence, x = -np.inf, mean
    for _ in range(LINEARISATIONS):
        expected, D, noises = _stacked(samples, x, model, unexplained)
        y = tau - expected + D @ (x - mean)
        found = [_gaussian(y, D @ covariance @ D.T + noise) for noise in noises]
        evidence = float(logsumexp([value for value, _ in found]) - np.log(len(found)))
        best = max(found, key=lambda one: one[0])[1]
        # Early, a few samples can point anywhere: no farther than the filter itself dares to linearise.
        x = mean + np.clip(covariance @ (D.T @ best), -PLAUSIBLE_SD * sd, PLAUSIBLE_SD * sd)
    return evidence


def _stacked(
    samples: Sequence[Sample], x: Parameters, model: TorqueModel, unexplained: Unexplained
) -> tuple[Stacked, Float[np.ndarray, "measurement parameter"], list[Float[np.ndarray, "measurement measurement"]]]:
    """Expected torque, its derivative, and the covariance of what else is in it, for each size of unrest."""
    noise = unexplained.noise
    t = np.array([sample.t for sample in samples])
    model.restart()
    expected, rows, white = [], [], []
    repeats = np.maximum(noise.correlation_s / np.diff(t).min(), 1.0)
    for sample in samples:
        tau, derivative = model.linearise(sample, x)
        expected.append(tau)
        rows.append(derivative)
        white.append(noise.sd**2 * repeats + model.direction_uncertainty(sample.v) ** 2)
    model.restart()
    known = np.diag(np.concatenate(white))
    if unexplained.discrepancy is not None:
        errors = np.vstack([unexplained.discrepancy.errors(sample.q) for sample in samples])
        known += errors @ errors.T
    together = np.exp(-np.abs(t[:, None] - t) / noise.disturbance_correlation_s)
    unrest = np.kron(together, np.diag(noise.disturbance_sd**2))
    return np.concatenate(expected), np.vstack(rows), [known + scale**2 * unrest for scale in DISTURBANCE_SCALES]


def _gaussian(y: Stacked, covariance: Float[np.ndarray, "measurement measurement"]) -> tuple[float, Stacked]:
    """Logarithm of the density of y (but for a constant), and covariance⁻¹ y."""
    lower = cholesky(covariance, lower=True)
    solved = cho_solve((lower, True), y)
    return float(-0.5 * y @ solved - np.log(np.diag(lower)).sum()), solved
