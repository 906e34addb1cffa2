"""Noise of the torque that a method assumes."""

from dataclasses import dataclass

from .interface import Joints


@dataclass(frozen=True)
class Noise:
    """What the expected torque cannot explain."""

    sd: Joints
    """Of the calibrated machine's residual [N·m]."""

    correlation_s: Joints
    """Its integrated autocorrelation time [s]."""

    disturbance_sd: Joints
    """Size of a slow disturbance, as assumed [N·m]: a wearer who does not quite relax, and errors of the model that
    change with the posture. The filter weighs multiples of it by the data."""

    disturbance_correlation_s: float = 3.0
    """Of the slow disturbance [s]; people: 1-5 s (docs/arm.md)."""
