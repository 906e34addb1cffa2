"""Direct fit of a payload to a whole log: the starting point for all checks of a method's result."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from exograv.identification.calibration.empty_machine import SAMPLE_PERIOD_S
from exograv.identification.core.interface import Parameters, Sample

from .payload import PAYLOAD, PayloadModel, payload_prior
from .robot_from_log import RobotFromLog, thinned

STEPS = 4
"""Linearisations [-]; only friction under load is not linear in the payload."""


@dataclass(frozen=True)
class FirstFit:
    """Payload by weighted least squares with a fixed robot; its body may be physically impossible."""

    x: Parameters
    """All parameters; the robot's are those of the unloaded logs."""

    covariance: Float[np.ndarray, "10 10"]
    """Covariance of the payload. It contains the coloured residual and the uncertainty of the robot: gains,
    friction between two logs, and links."""

    cost: float
    """Sum of squared weighted residuals."""


def first_fit(model: PayloadModel, robot: RobotFromLog, samples: list[Sample]) -> FirstFit:
    """Fit the payload's ten parameters with the robot of the unloaded logs, and the wide prior of a payload."""
    kept = thinned(samples)
    mean, prior_covariance = payload_prior()
    inverse, x = np.linalg.inv(prior_covariance), robot.x.copy()
    for _ in range(STEPS):
        residual, H = _weighted(model, robot, kept, x)
        by_payload = H[:, PAYLOAD]
        covariance = np.linalg.inv(by_payload.T @ by_payload + inverse)
        x[PAYLOAD] += covariance @ (by_payload.T @ residual + inverse @ (mean - x[PAYLOAD]))
    residual, H = _weighted(model, robot, kept, x)
    # An error of the fixed robot moves the payload by −moved · error (Schmidt's consider covariance).
    moved = covariance @ (H[:, PAYLOAD].T @ H)  # pyright: ignore[reportPossiblyUnboundVariable] - STEPS > 0
    total = covariance + moved @ robot.covariance @ moved.T  # pyright: ignore[reportPossiblyUnboundVariable]
    return FirstFit(x, total, float(residual @ residual))


def cost_at(model: PayloadModel, robot: RobotFromLog, samples: list[Sample], x: Parameters) -> float:
    """Sum of squared weighted residuals at any parameters, comparable with `FirstFit.cost`."""
    residual, _ = _weighted(model, robot, thinned(samples), x)
    return float(residual @ residual)


def _weighted(
    model: PayloadModel, robot: RobotFromLog, samples: list[Sample], x: Parameters
) -> tuple[Float[np.ndarray, " row"], Float[np.ndarray, "row parameter"]]:
    """Return residual and derivative of all samples, in standard deviations of the coloured residual."""
    repeats = np.maximum(robot.correlation_s / SAMPLE_PERIOD_S, 1.0)
    residual, H = [], []
    for sample in samples:
        tau, derivative = model.linearise(sample, x)
        sd = np.hypot(robot.residual_sd * np.sqrt(repeats), model.direction_uncertainty(sample.v))
        residual.append((sample.tau - tau) / sd)
        H.append(derivative / sd[:, None])
    return np.concatenate(residual), np.concatenate(H)
