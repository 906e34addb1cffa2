"""Noise of the torque that a method assumes."""

from dataclasses import dataclass

from .interface import Joints


@dataclass(frozen=True)
class Noise:
    """Noise of the measured torque around the expected torque."""

    sd: Joints
    """Standard deviation of the calibrated machine's residual [N·m]."""

    correlation_s: Joints
    """Integrated autocorrelation time of that residual [s]."""

    disturbance_sd: Joints
    """Assumed standard deviation of a slow disturbance [N·m]: a wearer who does not relax completely, and model errors
    that change with posture. The filter runs for several multiples of it and weights them by the data."""

    disturbance_correlation_s: float = 3.0
    """Correlation time of the slow disturbance [s]; people: 1-5 s (docs/explanation/arm.md)."""
