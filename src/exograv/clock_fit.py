"""How another clock runs against ours, by what has been measured of it now and then: a device on LSL, a web page."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

DRIFT_FROM_S = 20.0
"""Measurements over less than that say nothing of a drift: a fault of 0.1 ms would look like 5 millionths [s]."""

DRIFT_FROM = 5
"""Measurements, at least, for a straight line with an interval."""

HUBER = 1.345
"""Residuals beyond so many standard deviations count as their root: a probe that waited in a queue is late, never
early. Source: Huber 1981, Robust Statistics; 95 % efficient on Gaussian noise."""

ROUNDS = 30

ALIKE_MAX = 0.95
"""Correlation of neighbours; nearer to 1 it is a drift that has no straight line."""

T_975 = (12.706, 4.303, 3.182, 2.776, 2.571, 2.447, 2.365, 2.306, 2.262, 2.228)
"""97.5 % quantile of Student's t by degrees of freedom, from 1."""


@dataclass(frozen=True)
class ClockFit:
    """What has to be added to a stamp `s` of the device, [s]: offset + drift · (s − middle)."""

    middle: float
    """On the device's clock [s]."""

    offset: float
    """At `middle` [s]."""

    drift: float
    """Of our clock against the device's [s/s]; 0 where it cannot be known."""

    offset_ci95: tuple[float, float] | None
    drift_ci95: tuple[float, float] | None
    """95 % intervals, by the scatter of the measurements; None where they are too few."""

    residual: Float[np.ndarray, " measurement"]
    """Of each measurement that is not a repetition [s]."""

    has_drift: bool
    """Whether the measurements are enough for one."""

    def correction(self, stamps: Float[np.ndarray, " sample"]) -> Float[np.ndarray, " sample"]:
        """What to add to each stamp [s]."""
        return self.offset + self.drift * (stamps - self.middle)


def fit_clock(remote: Float[np.ndarray, " asked"], offset: Float[np.ndarray, " asked"]) -> ClockFit | None:
    """Straight line through what has been measured; a constant where it is too short; None where there is nothing.

    Args:
        remote: Time on the device's clock of each measurement [s]; a source (LSL) repeats one until it has a newer.
        offset: What was measured [s].
    """
    remote, first = np.unique(remote, return_index=True)
    offset = offset[first]
    if not len(remote):
        return None
    middle = float(np.mean(remote))
    has_drift = len(remote) >= DRIFT_FROM and bool(remote[-1] - remote[0] >= DRIFT_FROM_S)
    columns = np.column_stack([np.ones(len(remote)), remote - middle])[:, : 1 + has_drift]
    solution, covariance = _huber(columns, offset)
    residual = offset - columns @ solution
    half = None
    if (free := len(remote) - columns.shape[1]) > 0:
        half = (student_975(free) * _persistence(residual) * np.sqrt(np.diag(covariance))).tolist()
    found = float(solution[0]), float(solution[1]) if has_drift else 0.0
    around = [None, None] if half is None else [(found[k] - half[k], found[k] + half[k]) for k in range(len(half))]
    return ClockFit(middle, *found, around[0], around[1] if has_drift else None, residual, has_drift)


def _persistence(residual: Float[np.ndarray, " measurement"]) -> float:
    """How much wider an interval is because neighbours err alike: a busy network is busy for a while.

    By the correlation of neighbours, as of a first-order autoregression. Source: Bayley & Hammersley 1946.
    """
    power = float(residual @ residual)
    alike = float(residual[1:] @ residual[:-1]) / power if power > 0.0 else 0.0
    alike = min(max(alike, 0.0), ALIKE_MAX)
    return float(np.sqrt((1.0 + alike) / (1.0 - alike)))


def student_975(freedom: int) -> float:
    """97.5 % quantile of Student's t; beyond the table to 0.003, by the expansion of Cornish and Fisher."""
    if freedom <= len(T_975):
        return T_975[freedom - 1]
    return 1.959964 + 2.372271 / freedom + 2.822500 / freedom**2


def _huber(columns: np.ndarray, values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Solution and its covariance (Huber 1981, eq. 7.6.5)."""
    solution = np.linalg.lstsq(columns, values, rcond=None)[0]
    scale, bent = 0.0, values * 0.0
    for _ in range(ROUNDS):
        residual = values - columns @ solution
        scale = 1.4826 * float(np.median(np.abs(residual)))
        if scale <= 1e-12:
            break
        bent = np.clip(residual, -HUBER * scale, HUBER * scale)
        weights = np.sqrt(bent / np.where(residual == 0.0, scale, residual) + (residual == 0.0))
        solution = np.linalg.lstsq(columns * weights[:, None], values * weights, rcond=None)[0]
    inside = float(np.mean(np.abs(values - columns @ solution) <= HUBER * scale)) or 1.0
    freedom = max(len(values) - columns.shape[1], 1)
    variance = float(bent @ bent) / freedom / inside**2
    return solution, variance * np.linalg.inv(columns.T @ columns)
