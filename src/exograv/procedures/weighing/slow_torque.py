"""Information of a motion about unknowns while a restless wearer adds a slow torque: a batch solution in closed form.

Each joint's torque is y = H ξ + b + noise with unknowns ξ and an Ornstein–Uhlenbeck disturbance b. The size of b is not
known: several sizes are assumed and weighted by the data. This is the batch form of `identification.square_root`: all
rows of a motion enter at once, and the information can be combined with any prior.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import reduce
from operator import add

import numpy as np
from jaxtyping import Float
from scipy.linalg import solve_triangular

from exograv.identification.core.square_root import GATE, SlowDisturbance
from exograv.identification.recursive.recursive import USUAL_SCALES as SCALES

CORRELATION_S = 3.0  # of the slow torque; people: 1-5 s (docs/explanation/arm.md)

Vector = Float[np.ndarray, " unknown"]
Matrix = Float[np.ndarray, "unknown unknown"]


@dataclass(frozen=True)
class RegressionRows:
    """Samples of a motion, linear in the unknowns."""

    t: Float[np.ndarray, " sample"]
    """Time of the samples [s]."""

    H: Float[np.ndarray, "sample joint unknown"]
    """Derivative of the torque by the unknowns [N·m]."""

    y: Float[np.ndarray, "sample joint"]
    """Torque beyond the expected torque at ξ = 0 [N·m]."""

    noise: Float[np.ndarray, "sample joint"]
    """Standard deviation of white noise [N·m]."""


@dataclass(frozen=True)
class Information:
    """Logarithm of a likelihood: constant + vectorᵀ ξ − ½ ξᵀ matrix ξ."""

    matrix: Matrix
    vector: Vector
    constant: float

    def __add__(self, other: "Information") -> "Information":
        return Information(self.matrix + other.matrix, self.vector + other.vector, self.constant + other.constant)


@dataclass(frozen=True)
class Belief:
    """Posterior distribution of the unknowns, ξ ~ N(mean, covariance)."""

    mean: Vector
    covariance: Matrix
    log_evidence: float
    """Logarithm of the data's probability under the prior."""


def motion_information(
    motions: Sequence[RegressionRows],
    usual_sd: Float[np.ndarray, " joint"],
    expected: Vector | None = None,
    correlation_s: float = CORRELATION_S,
) -> list[Information]:
    """Return the information of separate motions, for each assumed size of the slow torque.

    Args:
        motions: Motions one after another, with pauses in which the slow torque changes.
        usual_sd: Usual size of the slow torque per joint; multiples of it are assumed [N·m].
        expected: Unknowns as known so far. The noise of samples that deviate from them by more than `GATE` standard
            deviations is increased until they do not (Huber).
        correlation_s: Correlation time of the slow torque [s].
    """
    sizes = np.asarray(SCALES)[:, None] * usual_sd
    each = [_of_motion(rows, sizes, correlation_s, expected) for rows in motions]
    return [reduce(add, parts) for parts in zip(*each, strict=True)]


def _of_motion(
    rows: RegressionRows, sizes: Float[np.ndarray, "size joint"], correlation_s: float, expected: Vector | None
) -> list[Information]:
    """Return the information of one motion, for each assumed size of the slow torque of each joint [N·m].

    The slow torque is a Markov process, so a scalar Kalman filter whitens the rows: whitened rows are innovations.
    """
    keep = np.exp(-np.diff(rows.t, prepend=rows.t[0]) / correlation_s)
    noise = np.repeat((rows.noise**2)[:, None], len(sizes), axis=1)
    if expected is not None:
        off = (rows.y - rows.H @ expected)[..., None]
        surprise, variance = SlowDisturbance(sizes**2, 1).all_innovations(keep, off, noise)
        noise += np.maximum((surprise[..., 0] / GATE) ** 2 - 1.0, 0.0) * variance
    columns = np.concatenate([rows.H, rows.y[..., None]], axis=-1)
    white, variance = SlowDisturbance(sizes**2, columns.shape[-1]).all_innovations(keep, columns, noise)
    constants = -0.5 * ((white[..., -1] ** 2).sum(axis=(0, 2)) + np.log(variance).sum(axis=(0, 2)))
    return [_summed(white[:, k], float(constant)) for k, constant in enumerate(constants)]


def _summed(white: Float[np.ndarray, "sample joint column"], constant: float) -> Information:
    """Sum the products of whitened rows; the last column is the measurement."""
    unknowns = white.shape[-1] - 1
    matrix, vector = np.zeros((unknowns, unknowns)), np.zeros(unknowns)
    for of_joint in np.moveaxis(white, 1, 0):
        # Most unknowns belong to one joint, and are zero in the rows of the others.
        used = np.flatnonzero(of_joint[:, :-1].any(axis=0))
        H = of_joint[:, used]
        matrix[np.ix_(used, used)] += H.T @ H
        vector[used] += H.T @ of_joint[:, -1]
    return Information(matrix, vector, constant)


def believed(information: Sequence[Information], mean: Vector, variance: Vector, considered: int = 0) -> Belief:
    """Combine data with a prior N(mean, diag(variance)), over all assumed sizes, which have equal prior probability.

    The last `considered` unknowns are not learned (Schmidt): they stay at their mean, and their possible effect widens
    the covariance of the others. This serves model errors from which wrong values would be learned.
    """
    each = [_with_prior(one, mean, variance, considered) for one in information]
    logs = np.array([one.log_evidence for one in each])
    weights = np.exp(logs - logs.max())
    total = logs.max() + float(np.log(weights.mean()))
    weights /= weights.sum()
    middle = weights @ np.array([one.mean for one in each])
    off = np.array([one.mean for one in each]) - middle
    covariance = np.tensordot(weights, np.array([one.covariance for one in each]), axes=1)
    return Belief(middle, covariance + (off.T * weights) @ off, total)


def _with_prior(data: Information, mean: Vector, variance: Vector, considered: int) -> Belief:
    count = len(mean)
    learned, others = slice(0, count - considered), slice(count - considered, count)
    precision, start = 1.0 / variance[learned], mean[learned]
    vector = data.vector[learned] - data.matrix[learned, others] @ mean[others]
    root = np.linalg.cholesky(data.matrix[learned, learned] + np.diag(precision))
    half = solve_triangular(root, vector + start * precision, lower=True)
    inverse = solve_triangular(root, np.eye(len(start)), lower=True)
    log_evidence = data.constant - 0.5 * float(np.log(variance[learned]).sum()) - float(np.log(np.diag(root)).sum())
    log_evidence += 0.5 * float(half @ half) - 0.5 * float(start @ (start * precision))
    moved = inverse.T @ (inverse @ data.matrix[learned, others]) * np.sqrt(variance[others])
    whole = np.diag(variance)
    whole[learned, learned] = inverse.T @ inverse + moved @ moved.T
    return Belief(np.concatenate([inverse.T @ half, mean[others]]), whole, log_evidence)
