"""Offset and drift of another clock against ours, fitted to measurements: a device on LSL, or a web page."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

DRIFT_FROM_S = 20.0
"""Shortest span of measurements that gives a drift [s]. Over less, an error of 0.1 ms looks like more than 5 ppm."""

DRIFT_FROM = 5
"""Smallest number of measurements for a straight line with an interval."""

HUBER = 1.345
"""Residual beyond which the cost grows linearly, not quadratically [standard deviations].

A probe that waited in a queue is late, never early: its residual is an outlier. Source: Huber 1981, Robust
Statistics; the estimate is 95 % efficient on Gaussian noise.
"""

ROUNDS = 30
"""Iterations of the reweighted least squares, at most."""

ALIKE_MAX = 0.95
"""Largest correlation of neighbouring residuals that is used [-]. A larger one shows a drift that is not linear."""

T_975 = (12.706, 4.303, 3.182, 2.776, 2.571, 2.447, 2.365, 2.306, 2.262, 2.228)
"""97.5 % quantile of Student's t by degrees of freedom, from 1."""


@dataclass(frozen=True)
class ClockFit:
    """Correction of a stamp `s` of the device to our clock [s]: offset + drift · (s − middle)."""

    middle: float
    """Mean time of the measurements on the device's clock [s]."""

    offset: float
    """Our clock minus the device's clock at `middle` [s]."""

    drift: float
    """Drift of our clock against the device's [s/s]; 0 if the measurements do not give one."""

    offset_ci95: tuple[float, float] | None
    drift_ci95: tuple[float, float] | None
    """95 % intervals from the scatter of the measurements; None if there are too few."""

    residual: Float[np.ndarray, " measurement"]
    """Residual of each measurement that is not a repetition [s]."""

    has_drift: bool
    """True if the measurements give a drift."""

    def correction(self, stamps: Float[np.ndarray, " sample"]) -> Float[np.ndarray, " sample"]:
        """Correction of each stamp of the device [s], to be added to the stamp."""
        return self.offset + self.drift * (stamps - self.middle)


def fit_clock(remote: Float[np.ndarray, " asked"], offset: Float[np.ndarray, " asked"]) -> ClockFit | None:
    """Fit a straight line to the measurements, or a constant if they span too short a time; None without measurements.

    Args:
        remote: Time of each measurement on the device's clock [s]. LSL repeats a measurement until the next one.
        offset: Our clock minus the device's clock, as measured [s].
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
    """Factor by which correlated errors widen an interval [-]: a busy network stays busy for a while.

    The residuals are taken as a first-order autoregression. Source: Bayley & Hammersley 1946.
    """
    power = float(residual @ residual)
    alike = float(residual[1:] @ residual[:-1]) / power if power > 0.0 else 0.0
    alike = min(max(alike, 0.0), ALIKE_MAX)
    return float(np.sqrt((1.0 + alike) / (1.0 - alike)))


def student_975(freedom: int) -> float:
    """97.5 % quantile of Student's t; beyond the table by the expansion of Cornish and Fisher, within 0.003."""
    if freedom <= len(T_975):
        return T_975[freedom - 1]
    return 1.959964 + 2.372271 / freedom + 2.822500 / freedom**2


def _huber(columns: np.ndarray, values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Robust solution and its covariance. Source: Huber 1981, eq. 7.6.5."""
    solution = np.linalg.lstsq(columns, values, rcond=None)[0]
    scale, bent = 0.0, values * 0.0
    for _ in range(ROUNDS):
        residual = values - columns @ solution
        # 1.4826 turns the median absolute deviation into the standard deviation of Gaussian noise.
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
