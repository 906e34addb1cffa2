"""A drive's whole numbers and the joint's quantities, one entry a joint; directions and zeros are of `drives.toml`."""

import numpy as np
from jaxtyping import Float, Int

from exograv.rig.drives.settings import Drives

DAMPING_MOST = 65.535
"""What the frame can carry [N·m·s/rad]."""

Joints = Float[np.ndarray, " joint"]
Counts = Int[np.ndarray, " joint"]


class Scaling:
    """Of one machine. Currents are per mille of what the drive has as rated, so one step is a thousandth of it."""

    def __init__(self, drives: Drives):
        rated = np.array([drive.current_rated_A for drive in drives.each])
        self._current_max = np.array([drive.current_max_A for drive in drives.each])
        self._rad = drives.sign * drives.rad_per_count
        per_motor = drives.rad_per_motor_count
        self._rad_motor = None if per_motor is None else drives.sign * per_motor
        self._offset = drives.offset
        self._amperes = drives.sign * rated / 1000.0

    def q(self, counts: Counts) -> Joints:
        """Of the joints [rad]."""
        return self._rad * counts + self._offset

    def q_motor(self, counts: Counts) -> Joints | None:
        """The same by the motors' encoders [rad]; None where not all have one."""
        return None if self._rad_motor is None else self._rad_motor * counts + self._offset

    def current(self, per_mille: Counts) -> Joints:
        """In joint direction [A]."""
        return self._amperes * per_mille

    def limited(self, current: Joints) -> Joints:
        """Within what the drives give at most [A]."""
        return np.clip(current, -self._current_max, self._current_max)

    def per_mille(self, current: Joints) -> Counts:
        """Of the rated current, in the drive's direction, to the nearest."""
        return np.rint(current / self._amperes).astype(np.int64)

    def damping(self, damping: Joints) -> Counts:
        """[mN·m·s/rad]; from [N·m·s/rad], no more than the frame can carry."""
        return np.rint(1000.0 * np.clip(damping, 0.0, DAMPING_MOST)).astype(np.int64)
