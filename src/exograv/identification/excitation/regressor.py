"""Regressor of an arm along a motion, and its derivatives with respect to the motion."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from exograv.identification.core.arm_model import SLOW_V, ArmModel
from exograv.identification.core.interface import Parameters, Sample

STEP = 1e-3  # rad, rad/s, rad/s²: finite difference; the error by curvature does not matter to the optimiser

WALK = 0.1  # rad: for larger steps the model needs a cold start of the closure, which takes a hundred times as long

Series = Float[np.ndarray, "sample joint"]


@dataclass(frozen=True)
class RegressorTrajectory:
    """Regressor and related quantities along a motion; derivatives are with respect to (q, v, a), 3 · joint entries."""

    H: Float[np.ndarray, "sample joint parameter"]
    """Derivative of the expected torque with respect to the parameters (the regressor) [N·m per unit of the parameter].
    """

    tau: Series
    """Expected torque of the joints [N·m]."""

    z: Float[np.ndarray, "sample freedom"]
    """Arm angles [rad]."""

    direction_sd: Series
    """Standard deviation of the torque from the uncertain direction of friction [N·m]."""

    direction_sd_by_v: Series
    """Derivative of `direction_sd` with respect to the joint's own velocity [N·m·s/rad]."""

    H_by: Float[np.ndarray, "sample direction joint parameter"]
    tau_by: Float[np.ndarray, "sample direction joint"]
    z_by: Float[np.ndarray, "sample direction freedom"]


def along(
    model: ArmModel, x: Parameters, q: Series, v: Series, a: Series, *, slopes: bool = True
) -> RegressorTrajectory:
    """Evaluate the model along a motion at parameters `x`.

    Derivatives are finite differences, because the closed posture has no symbolic expression.
    """
    model.restart()
    motion, directions = np.concatenate([q, v, a], axis=1), 3 * q.shape[1] if slopes else 0
    H, tau, z, sd = [], [], [], []
    before = motion[0]
    for row in motion:
        for way in _steps_between(before[: q.shape[1]], row[: q.shape[1]]):
            _at(model, x, before + way * (row - before))
        before = row
        rows = [_at(model, x, row)]
        sd.append(model.direction_uncertainty(row[q.shape[1] : 2 * q.shape[1]]))
        for direction in range(directions):
            moved = row.copy()
            moved[direction] += STEP
            rows.append(_at(model, x, moved))
        if slopes:
            rows[0] = _at(model, x, row)  # the closure has now converged to rounding
        for column, values in zip((H, tau, z), zip(*rows, strict=True), strict=True):
            column.append(np.array(values))
    H_all, tau_all, z_all, direction_sd = (np.array(column) for column in (H, tau, z, sd))
    by = [(whole[:, 1:] - whole[:, :1]) / STEP for whole in (H_all, tau_all, z_all)]
    slope = -2.0 * direction_sd * np.tanh(v / SLOW_V) / SLOW_V
    return RegressorTrajectory(H_all[:, 0], tau_all[:, 0], z_all[:, 0], direction_sd, slope, *by)


def _steps_between(q: Float[np.ndarray, " joint"], goal: Float[np.ndarray, " joint"]) -> Float[np.ndarray, " step"]:
    """Shares of the way between two postures at which the model is evaluated, so that the closure can follow."""
    count = int(np.abs(goal - q).max() / WALK)
    return np.arange(1, count + 1) / (count + 1)


def _at(
    model: ArmModel, x: Parameters, row: Float[np.ndarray, " direction"]
) -> tuple[Float[np.ndarray, "joint parameter"], Float[np.ndarray, " joint"], Float[np.ndarray, " freedom"]]:
    q, v, a = row.reshape(3, -1)
    tau, derivative = model.linearise(Sample(0.0, q, v, a, np.zeros_like(q)), x)
    return derivative.copy(), tau.copy(), model.z.copy()
