"""Check at held-out postures: does the residual torque there agree with the estimate from before?

The residual at a posture contains errors of the estimate, the discrepancy, and the wearer's slow torque. The size and
correlation time of the slow torque are known per joint from the residual of the fit. Without them a wearer who pushes
slowly would look like a wrong estimate.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int
from scipy.linalg import cho_solve, cholesky
from scipy.special import chdtrc

from .interface import Agreement
from .square_root import SlowDisturbance

FALSE_REJECTIONS = 0.01
"""Share of estimates that the check refuses although their model is right [-]; the joints share it (Bonferroni)."""

SLOW_SCALES = np.geomspace(0.25, 8.0, 11)
"""Multiples of the assumed slow torque that are compared per joint [-]."""

SLOW_TIMES_S = (1.5, 3.0, 5.0)
"""Correlation times of the slow torque that are compared [s]; people: 1-5 s (docs/explanation/arm.md)."""

JOINED = 3
"""Number of consecutive samples that are joined for the test: 0.24 s, short against the slow torque [-]."""

CERTAIN_SHARE = 1e-4
"""Probability below which an assumption on the slow torque is left out [-]."""


@dataclass(frozen=True)
class Residuals:
    """Residuals of one joint: those of the fit, then those of the check."""

    dt: Float[np.ndarray, " sample"]
    """Time since the sample before [s]."""

    torque: Float[np.ndarray, " sample"]
    """Measured torque minus the torque of the estimate from before the check [N·m]."""

    noise_sd: Float[np.ndarray, " sample"]
    """Standard deviation of the white noise [N·m]."""

    slow_sd: float
    """Assumed standard deviation of the slow torque [N·m]."""

    expected: Float[np.ndarray, "held held"]
    """Covariance of the check's residuals by errors of the estimate and by the discrepancy [N²·m²]."""

    visited: Int[np.ndarray, " held"]
    """Index of the posture nearest to each sample of the check."""


def agreement(joints: list[Residuals]) -> Agreement:
    """Test each joint: mean residual at each posture against its predicted distribution (normalised innovation).

    For a given slow torque the means of a joint are normal, and their normalised square has a χ² distribution. The
    probabilities are averaged over the slow torques, with the weights that the residuals of the fit give them.

    Source: Bar-Shalom, Li & Kirubarajan 2001, Estimation with Applications to Tracking and Navigation, ch. 5.4.
    """
    found = [_tested(joint) for joint in joints]
    p, residual, expected = (np.array(column) for column in zip(*found, strict=True))
    return Agreement(p, residual, expected, FALSE_REJECTIONS / len(joints))


def _tested(joint: Residuals) -> tuple[float, float, float]:
    """Probability of residuals at least as large, their RMS over the postures, and the expected RMS [N·m]."""
    held = len(joint.visited)
    weights = _weights(joint)
    count = held // JOINED
    precision = joint.noise_sd[-held:][: count * JOINED].reshape(count, JOINED) ** -2.0
    join = np.zeros((count, held))
    for k, row in enumerate(precision):
        join[k, k * JOINED : (k + 1) * JOINED] = row / row.sum()
    r, expected = join @ joint.torque[-held:], join @ joint.expected @ join.T
    white = np.diag(1.0 / precision.sum(axis=1))
    t = np.cumsum(joint.dt[-held:])
    apart = np.abs(t[:, None] - t)
    postures = np.unique(joint.visited)
    at = np.array([join @ (joint.visited == k) for k in postures]).T
    probability, variance, means = 0.0, np.zeros(len(postures)), np.zeros(len(postures))
    for time_s, of_time in zip(SLOW_TIMES_S, weights, strict=True):
        together = join @ np.exp(-apart / time_s) @ join.T
        for scale, weight in zip(SLOW_SCALES, of_time, strict=True):
            if weight < CERTAIN_SHARE:
                continue
            lower = cholesky((scale * joint.slow_sd) ** 2 * together + white, lower=True), True
            solved = cho_solve(lower, at)
            own = np.linalg.inv(at.T @ solved)
            mean = own @ solved.T @ r
            covariance = own + own @ solved.T @ expected @ solved @ own
            probability += weight * chdtrc(len(mean), mean @ np.linalg.solve(covariance, mean))
            means, variance = means + weight * mean, variance + weight * np.diag(covariance)
    share = weights[weights >= CERTAIN_SHARE].sum()
    return (
        float(probability / share),
        float(np.sqrt(np.mean((means / share) ** 2))),
        float(np.sqrt(np.mean(variance) / share)),
    )


def _weights(joint: Residuals) -> Float[np.ndarray, "time scale"]:
    """Probability of each correlation time and size of the slow torque, by the residuals of the fit."""
    before = len(joint.torque) - len(joint.visited)
    dt, torque, noise = joint.dt[:before], joint.torque[:before], joint.noise_sd[:before]
    variance = (SLOW_SCALES * joint.slow_sd)[:, None] ** 2
    log = []
    for time_s in SLOW_TIMES_S:
        slow = SlowDisturbance(variance, 1)
        whitened, total = slow.all_innovations(np.exp(-dt / time_s), torque[:, None, None], noise[:, None] ** 2)
        log.append(-0.5 * (whitened[..., 0, 0] ** 2 + np.log(total[..., 0])).sum(axis=0))
    log = np.array(log)
    weights = np.exp(log - log.max())
    return weights / weights.sum()


def nearest(
    q: Float[np.ndarray, "held joint"], postures: Float[np.ndarray, "posture joint"]
) -> Int[np.ndarray, " held"]:
    """Index of the posture nearest to each sample, by the joint that is farthest off."""
    return np.abs(q[:, None] - postures).max(axis=2).argmin(axis=1)
