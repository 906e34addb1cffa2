"""Comparison of two priors by the first seconds of motion: do the samples contradict the prior of this person?"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from scipy.linalg import cho_solve, cholesky
from scipy.special import logsumexp

from exograv.identification.core.discrepancy import Discrepancy
from exograv.identification.core.interface import Sample, TorqueModel
from exograv.identification.core.noise import Noise
from exograv.identification.core.square_root import FilterBank

from .recursive import PLAUSIBLE_SD, USUAL_SCALES

LINEARISATIONS = 3
"""Gauss–Newton steps to the posterior mode; the torque is non-linear in the fit."""

REWEIGHTINGS = 2
"""Number of times the weights of bursts are recomputed."""

Parameters = Float[np.ndarray, " parameter"]
Covariance = Float[np.ndarray, "parameter parameter"]
Belief = tuple[Parameters, Covariance]
Stacked = Float[np.ndarray, " measurement"]
Each = Float[np.ndarray, "sample joint"]


@dataclass(frozen=True)
class UnexplainedTorque:
    """Torque that neither prior of the arm explains: noise and discrepancy."""

    noise: Noise
    discrepancy: Discrepancy | None


def log_odds(
    one: Belief, other: Belief, samples: Sequence[Sample], model: TorqueModel, rest: UnexplainedTorque
) -> float:
    """Logarithm of the Bayes factor of prior `one` over prior `other`, averaged over sizes of the wearer's slow torque.

    A muscle burst that neither prior explains would favour the prior that happens to fit it, and a narrow prior loses
    more by it. The noise of a burst is therefore enlarged until its normalised innovation is `GATE`, as in the filter.
    Both priors use the same noise: the smaller of the two that they need.

    Source: MacKay 2003, Information Theory, Inference and Learning Algorithms, ch. 28 (Laplace's approximation).
    """
    noise = _noise(samples, model, other[0], rest.noise)
    found = [_evidence(belief, samples, model, rest, noise) for belief in (one, other)]
    for _ in range(REWEIGHTINGS):
        held_back = np.minimum(*(_held_back(samples, e, noise, rest.noise) for e in found))
        found = [_evidence(belief, samples, model, rest, held_back) for belief in (one, other)]
    return found[0].log - found[1].log


@dataclass(frozen=True)
class _Evidence:
    """Evidence of one prior."""

    log: float
    residual: Each
    """Residual torque at the posterior mode [N·m]."""

    scale: float
    """Most likely size of the wearer's slow torque over the assumed size [-]."""


def _evidence(
    belief: Belief, samples: Sequence[Sample], model: TorqueModel, rest: UnexplainedTorque, noise_sd: Each
) -> _Evidence:
    """Evidence of the samples for one prior, averaged over the sizes of the wearer's slow torque."""
    mean, covariance = belief
    sd = np.sqrt(np.diag(covariance))
    tau = np.concatenate([sample.tau for sample in samples])
    known, unrest = _unexplained(samples, rest, noise_sd)
    log, x, size, residual = -np.inf, mean, 0, tau
    for _ in range(LINEARISATIONS):
        expected, D = _stacked(samples, x, model)
        y = tau - expected + D @ (x - mean)
        believed = D @ covariance @ D.T + known
        found = [_gaussian(y, believed + scale**2 * unrest) for scale in USUAL_SCALES]
        log = float(logsumexp([value for value, _ in found]) - np.log(len(found)))
        size = int(np.argmax([value for value, _ in found]))
        step = covariance @ (D.T @ found[size][1])
        residual = y - D @ step
        # A few early samples can give any direction, so the step is limited as in the filter's linearisation.
        x = mean + np.clip(step, -PLAUSIBLE_SD * sd, PLAUSIBLE_SD * sd)
    return _Evidence(log, residual.reshape(len(samples), -1), float(USUAL_SCALES[size]))


def _held_back(samples: Sequence[Sample], found: _Evidence, noise_sd: Each, noise: Noise) -> Each:
    """Noise (sample, joint) [N·m] at which no residual of the prior exceeds the gate."""
    filters = FilterBank(0, found.scale * noise.disturbance_sd[None], noise.disturbance_correlation_s)
    dt = np.diff([sample.t for sample in samples], prepend=samples[0].t)
    return filters.all_held_back(dt, found.residual, noise_sd)[0]


def _noise(samples: Sequence[Sample], model: TorqueModel, x: Parameters, noise: Noise) -> Each:
    """Return the standard deviation of the noise of each sample [N·m].

    The variance grows if the samples are closer together than the correlation time of the residual.
    """
    apart = np.diff([sample.t for sample in samples]).min()
    own = noise.sd * np.sqrt(np.maximum(noise.correlation_s / apart, 1.0))
    model.restart()
    sd = []
    for sample in samples:
        model.linearise(sample, x)  # `direction_uncertainty` refers to the sample linearised last
        sd.append(np.hypot(own, model.direction_uncertainty(sample.v)))
    model.restart()
    return np.array(sd)


def _stacked(
    samples: Sequence[Sample], x: Parameters, model: TorqueModel
) -> tuple[Stacked, Float[np.ndarray, "measurement parameter"]]:
    """Stack the expected torque of all samples, and its derivative."""
    model.restart()
    expected, rows = zip(*(model.linearise(sample, x) for sample in samples), strict=True)
    model.restart()
    return np.concatenate(expected), np.vstack(rows)


def _unexplained(
    samples: Sequence[Sample], rest: UnexplainedTorque, noise_sd: Each
) -> tuple[Float[np.ndarray, "measurement measurement"], Float[np.ndarray, "measurement measurement"]]:
    """Covariance of noise and discrepancy, and covariance of the wearer's slow torque at scale 1."""
    known = np.diag(noise_sd.ravel() ** 2)
    if rest.discrepancy is not None:
        errors = np.vstack([rest.discrepancy.errors(sample.q, sample.v) for sample in samples])
        known += errors @ errors.T
    t = np.array([sample.t for sample in samples])
    together = np.exp(-np.abs(t[:, None] - t) / rest.noise.disturbance_correlation_s)
    return known, np.kron(together, np.diag(rest.noise.disturbance_sd**2))


def _gaussian(y: Stacked, covariance: Float[np.ndarray, "measurement measurement"]) -> tuple[float, Stacked]:
    """Logarithm of the density of y up to a constant, and covariance⁻¹ y."""
    lower = cholesky(covariance, lower=True)
    solved = cho_solve((lower, True), y)
    return float(-0.5 * y @ solved - np.log(np.diag(lower)).sum()), solved
