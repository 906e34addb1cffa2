"""Gain of the motors by temperature: share by which the torque per current changes per degree of the winding.

    residual = -slope · (temperature - mean) · nominal torque

The residual is the nominal torque that the fitted twin leaves unexplained. The fit has put what it could into the gain
and into friction at the mean temperature, so both are free here, and friction may change with temperature too.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float

from exograv.identification.calibration.empty_fit import SAMPLE_PERIOD_S, EmptyMachine, Fit
from exograv.identification.core.correlation import integrated_correlation

from .measured_motion import Samples

VARIED_LEAST_C = 5.0
"""Range of a winding's temperature from which a slope is told [°C]. Gains change by some tenths of a
per cent per degree, so that the change is then about one per cent."""

SAMPLES_LEAST = 100

Joints = Float[np.ndarray, " joint"]


@dataclass(frozen=True)
class GainByTemperature:
    """Change of the gains with the temperature of the windings; NaN where the recordings do not tell it."""

    slope_per_C: Joints
    """Change of the gain over the gain, per degree [1/°C]."""

    sd: Joints
    mean_C: Joints
    """Mean temperature in clear motion, to which the fitted gain belongs [°C]; NaN without temperatures."""
    lowest_C: Joints
    """Lowest and highest temperature in clear motion [°C]; NaN without temperatures."""
    highest_C: Joints


def gain_by_temperature(model: EmptyMachine, fit: Fit, samples: Samples) -> GainByTemperature:
    """Fit the slope of each gain over temperature."""
    sweeps = samples.sweeps
    nominal = model.description.nominal_gain * sweeps.current
    residual = model.residual(sweeps, fit.theta, float(sweeps.t[-1]))
    joints = residual.shape[1]
    slope, sd, mean, lowest, highest = np.full((5, joints), np.nan)
    for joint in range(joints):
        temperature = samples.temperature[:, joint]
        known = sweeps.clear[:, joint] & np.isfinite(temperature)
        if known.any():
            mean[joint], lowest[joint] = temperature[known].mean(), temperature[known].min()
            highest[joint] = temperature[known].max()
            slope[joint], sd[joint] = slope_of_gain(
                nominal[:, joint], residual[:, joint], sweeps.v[:, joint], temperature, known
            )
    return GainByTemperature(slope, sd, mean, lowest, highest)


def slope_of_gain(
    nominal: Float[np.ndarray, " sample"],
    residual: Float[np.ndarray, " sample"],
    v: Float[np.ndarray, " sample"],
    temperature: Float[np.ndarray, " sample"],
    known: Bool[np.ndarray, " sample"],
) -> tuple[float, float]:
    """Return the slope of one gain per degree [1/°C] and its standard deviation; NaN if it is not told.

    Args:
        nominal: Measured current in torque by the nominal gain [N·m].
        residual: Part of it that the fitted twin leaves unexplained [N·m].
        v: Velocity of the joint [rad/s].
        temperature: Temperature of the winding [°C].
        known: True for the samples that count.
    """
    if known.sum() < SAMPLES_LEAST or np.ptp(temperature[known]) < VARIED_LEAST_C:
        return np.nan, np.nan
    warmer, load, direction = temperature[known] - temperature[known].mean(), nominal[known], np.sign(v[known])
    design = np.column_stack([-warmer * load, load, direction, warmer * direction, np.ones(len(load))])
    scale = np.linalg.norm(design, axis=0)
    if np.linalg.matrix_rank(design / scale, tol=1e-3) < design.shape[1]:
        return np.nan, np.nan
    found, *_ = np.linalg.lstsq(design / scale, residual[known], rcond=None)
    left = residual[known] - design / scale @ found
    # Successive residuals repeat each other: the number of independent ones is smaller.
    repeats = max(integrated_correlation(left, SAMPLE_PERIOD_S) / SAMPLE_PERIOD_S, 1.0)
    inverse = np.linalg.inv((design / scale).T @ (design / scale))
    by_residual = np.std(left) * np.sqrt(repeats * inverse[0, 0])
    return float(found[0] / scale[0]), float(by_residual / scale[0])
