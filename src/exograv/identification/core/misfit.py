"""Goodness of fit: size of the residual torque that repeats at every pass through a posture.

Noise and a restless wearer leave residuals as well, but not the same one at each pass. What repeats is an error of the
model, and an error of the model also bends the estimate.
"""

import numpy as np
from jaxtyping import Float
from scipy.linalg import cholesky, solve_triangular

from .square_root import SlowDisturbance

MISFITS = np.array([0.25, 0.5, 1.0, 2.0, 4.0, 8.0])
"""Multiples of the expected discrepancy that are compared [-]."""

USUAL_MISFIT = 0.5
"""Multiple up to which the expected discrepancy covers the errors of an estimate [-], from wearers with seeds of 2000
on. Above it the considered errors grow in proportion."""


def misfit(
    keep: Float[np.ndarray, " sample"],
    H: Float[np.ndarray, "sample joint unknown"],
    y: Float[np.ndarray, "sample joint"],
    fields: Float[np.ndarray, "sample joint considered"],
    noise_sd: Float[np.ndarray, "sample joint"],
    slow_sd: Float[np.ndarray, " joint"],
) -> float:
    """Mean multiple of the expected discrepancy [-], weighed by the evidence of the samples.

    Each joint has its own fields. Unknowns and fields are fitted together: what wrong parameters can explain does not
    count against a field.

    Args:
        keep: Share of the slow disturbance that persists from the sample before.
        H: Derivative of the torque with respect to unknowns of unit variance [N·m].
        y: Torque minus the torque expected before any motion [N·m].
        fields: Torque of each joint's fields at one standard deviation [N·m].
        noise_sd: Standard deviation of the white noise [N·m].
        slow_sd: Standard deviation of the slow disturbance of each joint [N·m].
    """
    (joints, unknowns), count = H.shape[1:], fields.shape[-1]
    slow = SlowDisturbance(slow_sd[None] ** 2, unknowns + 1 + count)
    rows = np.concatenate([H, y[..., None], fields], axis=-1)
    whitened = slow.all_innovations(keep, rows, noise_sd**2)[0][:, 0]
    columns = np.zeros((*y.shape, unknowns + joints * count))
    columns[..., :unknowns] = whitened[..., :unknowns]
    for j in range(joints):
        columns[:, j, unknowns + j * count : unknowns + (j + 1) * count] = whitened[:, j, unknowns + 1 :]
    columns = columns.reshape(-1, columns.shape[-1])
    information, right = columns.T @ columns, columns.T @ whitened[..., unknowns].ravel()
    log_evidence = np.array([_log_evidence(information, right, unknowns, multiple) for multiple in MISFITS])
    evidence = np.exp(log_evidence - log_evidence.max())
    return float(evidence @ MISFITS / evidence.sum())


def _log_evidence(
    information: Float[np.ndarray, "column column"], right: Float[np.ndarray, " column"], unknowns: int, multiple: float
) -> float:
    """Logarithm of the evidence up to a constant, with fields of this multiple of their standard deviation."""
    sd = np.ones(len(right))
    sd[unknowns:] = multiple
    lower = cholesky(np.eye(len(sd)) + sd[:, None] * information * sd, lower=True)
    solved = solve_triangular(lower, sd * right, lower=True)
    return float(0.5 * solved @ solved - np.log(np.diag(lower)).sum())
