"""Drive of a joint: conversion between motor current and joint torque."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

Joints = Float[np.ndarray, " joint"]


@dataclass(frozen=True)
class ActuatorGain:
    """Joint torque per motor current: current × torque constant × gear ratio × efficiency, as calibrated.

    The efficiency is a constant factor here. Losses that grow with the load belong to `Friction.load_share`.
    """

    gain: Joints
    """Joint torque per current [N·m/A]."""

    gain_sd: Joints
    """Standard deviation of the calibrated gain [N·m/A]."""

    def torque(self, current: Float[np.ndarray, "*state joint"]) -> Float[np.ndarray, "*state joint"]:
        """Motor torque on the joint [N·m], before friction."""
        return self.gain * current

    def current(self, tau: Float[np.ndarray, "*state joint"]) -> Float[np.ndarray, "*state joint"]:
        """Motor current [A] for a torque [N·m]."""
        return tau / self.gain
