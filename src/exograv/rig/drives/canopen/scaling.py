"""A CiA 402 drive's whole numbers and the joint's quantities, one entry a joint."""

import numpy as np
from jaxtyping import Float, Int

from exograv.rig.drives.settings import Drives
from exograv.rig.drives.units import Units

DAMPING_MOST = 65.535
"""What the frame can carry [N·m·s/rad]."""

Joints = Float[np.ndarray, " joint"]
Counts = Int[np.ndarray, " joint"]


class Scaling(Units):
    """Of one machine. Currents are per mille of what the drive has as rated, so one step is a thousandth of it."""

    def __init__(self, drives: Drives):
        super().__init__(drives)
        rated = np.array([drive.current_rated_A for drive in drives.each])
        self._amperes = drives.sign * rated / 1000.0

    def current(self, per_mille: Counts) -> Joints:
        """In joint direction [A]."""
        return self._amperes * per_mille

    def per_mille(self, current: Joints) -> Counts:
        """Of the rated current, in the drive's direction, to the nearest."""
        return np.rint(current / self._amperes).astype(np.int64)

    def damping(self, damping: Joints) -> Counts:
        """[mN·m·s/rad]; from [N·m·s/rad], no more than the frame can carry."""
        return np.rint(1000.0 * np.clip(damping, 0.0, DAMPING_MOST)).astype(np.int64)
