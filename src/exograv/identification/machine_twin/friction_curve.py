"""Friction of each joint by its speed, with its interval, and the friction that held-out motion shows."""

from dataclasses import dataclass

import casadi as ca
import numpy as np
from jaxtyping import Float

from exograv.identification.calibration.empty_fit import EmptyMachine, Fit, Sweeps
from exograv.identification.calibration.empty_model import friction_by_unknowns

SLOWEST = 0.02
"""Lowest speed of a curve [rad/s]: slower samples are not fitted."""

SPEEDS = 30
"""Number of speeds in each direction."""

BINS = 12
"""Number of bins of the measured friction in each direction."""

BIN_LEAST = 5
"""Least number of samples of a bin."""


@dataclass(frozen=True)
class FrictionCurve:
    """Friction torque of the unloaded joints at constant speeds, as at the end of the recordings."""

    v: Float[np.ndarray, "speed joint"]
    """Speeds up to the largest one of each joint, rising [rad/s]."""

    torque: Float[np.ndarray, "speed joint"]
    """Friction torque, positive along a positive speed [N·m]."""

    sd: Float[np.ndarray, "speed joint"]
    """Standard deviation of the friction torque [N·m]."""

    measured_v: Float[np.ndarray, "bin joint"]
    """Mean speed of each bin of the held-out samples [rad/s]; NaN where a bin has few samples."""

    measured: Float[np.ndarray, "bin joint"]
    """Median friction torque of each bin: curve plus residual torque [N·m]."""


def friction_curve(model: EmptyMachine, fit: Fit, held: Sweeps, t_end: float) -> FrictionCurve:
    """Evaluate friction with its interval, and compare it with samples at ages before `t_end` [s]."""
    layout = fit.prior.layout
    fastest = np.nanmax(np.where(held.clear, np.abs(held.v), np.nan), axis=0)
    rising = np.array([np.geomspace(SLOWEST, max(one, 2.0 * SLOWEST), SPEEDS) for one in fastest.tolist()]).T
    v = np.concatenate([-rising[::-1], rising])
    function = _friction_function(layout.joints, layout.per_joint, fit.theta[: layout.tilt.start])
    torque, sd = np.empty(v.shape), np.empty(v.shape)
    block = fit.covariance[: layout.tilt.start, : layout.tilt.start]
    for row, speeds in enumerate(v):
        value, slope = (np.asarray(one.full()) for one in function.call([ca.DM(speeds)]))
        torque[row], sd[row] = value[:, 0], np.sqrt(np.einsum("ju,uv,jv->j", slope, block, slope))
    left = model.residual(held, fit.theta, t_end) / fit.theta[layout.of("inverse_gain")]
    measured_v, measured = np.full((2 * BINS, layout.joints), np.nan), np.full((2 * BINS, layout.joints), np.nan)
    for joint in range(layout.joints):
        clear, speed = held.clear[:, joint], held.v[:, joint]
        shown = left[:, joint] + np.interp(speed, v[:, joint], torque[:, joint])
        edges = np.geomspace(SLOWEST, rising[-1, joint] * (1.0 + 1e-9), BINS + 1)
        for number in range(2 * BINS):
            sign, place = (1.0, number - BINS) if number >= BINS else (-1.0, BINS - 1 - number)
            chosen = clear & (sign * speed >= edges[place]) & (sign * speed < edges[place + 1])
            if chosen.sum() >= BIN_LEAST:
                measured_v[number, joint], measured[number, joint] = speed[chosen].mean(), np.median(shown[chosen])
    return FrictionCurve(v, torque, sd, measured_v, measured)


def _friction_function(joints: int, per_joint: tuple[str, ...], value: Float[np.ndarray, " unknown"]) -> ca.Function:
    """Friction of the unloaded joints (joint,) [N·m] by speed, and its derivative (joint, unknown) at these values."""
    v, theta = ca.SX.sym("v", joints), ca.SX.sym("theta", len(value))
    unknown = {name: theta[k * joints : (k + 1) * joints] for k, name in enumerate(per_joint)}
    torque = friction_by_unknowns(unknown, ca.SX(0), v, ca.SX.zeros(joints))
    both = ca.Function("curve", [v, theta], [torque, ca.jacobian(torque, theta)])
    return ca.Function("friction", [v], both.call([v, ca.DM(value)]))
