"""Re-check of the arm's weight: how much heavier than its file does the relaxed arm look in the last seconds?"""

from dataclasses import dataclass

import numpy as np

from exograv.identification.core.interface import RESTLESS
from exograv.identification.core.noise import Noise

from .alarm_rate import Joints

BLOCK_S = 1.0
"""Duration of the means that enter as one row [s]."""

CHECK_S = 15.0
"""Time of a relaxed wearer between two results [s]. With the two seconds before it, another person's file is found
within the 20 s of its budget (docs/explanation/safety.md, F48)."""

KEEPS = 0.78
"""Weight of earlier seconds in the next result [-]: a memory of a minute."""

SURE = 4.6
"""Standard errors by which the arm's weight must differ [-]: once in 240 000 checks, or in 1000 h, by chance."""


@dataclass(frozen=True)
class ScaleCheck:
    """Result of one check."""

    excess: float
    """Weight of the arm beyond that of its file, as a share [-]."""

    sd: float
    """Standard error of `excess` [-]."""

    hidden: float
    """Share of the arm's weight that friction may carry [-]. At rest it is the same in all seconds, so no time averages
    it."""

    @property
    def is_contradicted(self) -> bool:
        """True if the arm is clearly heavier or lighter than its file."""
        return abs(self.excess) > SURE * self.sd + self.hidden


class ArmScale:
    """Weighted regression of the residual torque on the torque of the arm, over all joints together."""

    def __init__(self, noise: Noise):
        """Begin the first check."""
        self._noise = noise
        self._sums = np.zeros(6)
        self._rows, self._seconds = np.zeros((4, len(noise.sd))), 0.0
        self._relaxed_s = 0.0

    def restart(self) -> None:
        """Drop the present check, for example after a gap."""
        self._rows[:], self._seconds = 0.0, 0.0
        self._sums[:], self._relaxed_s = 0.0, 0.0

    def take(
        self, dt: float, residual: Joints, arm: Joints, friction: Joints, sd: Joints, scale: Joints
    ) -> ScaleCheck | None:
        """Add a sample; return the result at the end of a check.

        Args:
            dt: Time since the previous sample [s].
            residual: Measured torque minus the torque of the model (joint,) [N·m].
            arm: Torque of the arm alone, by the file (joint,) [N·m].
            friction: Torque that friction may hide or add (joint,) [N·m].
            sd: Standard deviation of the model's torque (joint,) [N·m].
            scale: Size of the wearer's slow torque over the assumed size (joint,) [-].
        """
        self._rows += dt * np.array([residual, arm, np.where(np.isfinite(friction), friction, 1e3), sd])
        self._seconds += dt
        if self._seconds < BLOCK_S - 0.5 * dt:
            return None
        mean_residual, mean_arm, mean_friction, mean_sd = self._rows / self._seconds
        self._rows[:], self._seconds = 0.0, 0.0
        if (scale > RESTLESS).any():
            return None  # a wearer who does not relax may push as an arm of another weight would
        # A mean of the slow torque repeats the ones before: its variance counts as that of independent means.
        slow = 2.0 * (scale * self._noise.disturbance_sd) ** 2 * self._noise.disturbance_correlation_s / BLOCK_S
        variance = slow + mean_friction**2 / 3.0
        own, stuck = np.abs(mean_arm) * mean_sd, np.abs(mean_arm) * mean_friction
        rows = np.array([mean_arm**2, mean_arm * mean_residual, own, stuck, mean_residual**2, variance])
        self._sums += (rows / variance).sum(axis=1)
        self._relaxed_s += BLOCK_S
        if self._relaxed_s < CHECK_S - 0.5:
            return None
        result = self._result()
        self._sums *= KEEPS
        self._relaxed_s = 0.0
        return result

    def _result(self) -> ScaleCheck:
        information, weighted, own, stuck, squares, count = self._sums
        # A wearer who pushes at one joint is no heavier arm: what the weight does not explain widens the interval.
        unexplained = (squares - weighted**2 / information) / max(count - 1.0, 1.0)
        # Errors of the model are the same in all rows, with the worst signs.
        sd = np.hypot(np.sqrt(max(unexplained, 1.0) / information), own / information)
        return ScaleCheck(float(-weighted / information), float(sd), float(stuck / information))
