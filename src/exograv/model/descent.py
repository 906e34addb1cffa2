"""Least squares for many postures at once: Levenberg–Marquardt on one batch of a native kernel."""

import numpy as np
from jaxtyping import Float

from exograv import kernel

STEPS = 100
"""Largest number of steps [-]; twenty are usual."""

SETTLED_RAD = 1e-9
"""Largest step of a settled posture [rad]."""

DAMPING_FIRST, DAMPING_MIN, DAMPING_MAX = 1e-3, 1e-12, 1e12
"""Damping over the diagonal of JᵀJ [-]. A better step divides it by `EASING`, a worse step multiplies it."""

EASING = 10.0

States = Float[np.ndarray, "state freedom"]


def descend(bound: kernel.BoundBatch, z: States) -> States:
    """Return the local minima of |residual|² that are reached from `z`, one row per state.

    Args:
        bound: Batch with the argument `z` (freedom,) and the results `residual` (row,) and `jacobian` (row, freedom);
            the caller has written all other arguments.
        z: Starts.
    """
    z = z.copy()
    cost, gradient, curvature = _evaluated(bound, z)
    damping = np.full(len(z), DAMPING_FIRST)
    for _ in range(STEPS):
        step = -_solved(curvature, damping, gradient)
        trial_cost, trial_gradient, trial_curvature = _evaluated(bound, z + step)
        better = trial_cost <= cost
        z[better] += step[better]
        cost[better], gradient[better] = trial_cost[better], trial_gradient[better]
        curvature[better] = trial_curvature[better]
        damping = np.clip(np.where(better, damping / EASING, damping * EASING), DAMPING_MIN, DAMPING_MAX)
        if np.abs(step).max() < SETTLED_RAD:
            break
    return z


def _evaluated(bound: kernel.BoundBatch, z: States) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Half of the squared residual (state,), its gradient (state, freedom), and JᵀJ (state, freedom, freedom)."""
    bound.inputs["z"][...] = z.T
    outputs = bound()
    residual, jacobian = outputs["residual"].T, outputs["jacobian"].transpose(2, 0, 1)
    cost = 0.5 * np.einsum("sr,sr->s", residual, residual)
    return cost, np.einsum("srf,sr->sf", jacobian, residual), jacobian.transpose(0, 2, 1) @ jacobian


def _solved(curvature: np.ndarray, damping: Float[np.ndarray, " state"], right: States) -> States:
    diagonal = np.einsum("sff->sf", curvature)
    damped = curvature + (damping[:, None] * diagonal)[:, :, None] * np.eye(right.shape[1])
    return np.linalg.solve(damped, right[:, :, None])[:, :, 0]
