"""Re-check of the arm's weight: how much heavier than its file does the relaxed arm look in the last seconds?"""

from dataclasses import dataclass

import numpy as np

from exograv.identification.core.left_over import RESTLESS
from exograv.identification.core.noise import Noise

from .alarm_rate import Joints

BLOCK_S = 1.0
"""Duration of the means that enter as one row [s]."""

CHECK_S = 15.0
"""Time after which a check ends and the next begins [s]. With the two seconds before it, another person's file is found
within the 20 s of its budget (docs/explanation/safety.md, F48)."""

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
        self._rows, self._seconds = np.zeros((4, len(noise.sd))), 0.0
        self._begin()

    def restart(self) -> None:
        """Drop the present check, for example after a gap."""
        self._rows[:], self._seconds = 0.0, 0.0
        self._begin()

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
        self._information += float((mean_arm**2 / variance).sum())
        self._weighted += float((mean_arm * mean_residual / variance).sum())
        self._own += float((np.abs(mean_arm) * mean_sd / variance).sum())
        self._stuck += float((np.abs(mean_arm) * mean_friction / variance).sum())
        self._squares += float((mean_residual**2 / variance).sum())
        self._count += len(variance)
        self._relaxed_s += BLOCK_S
        if self._relaxed_s < CHECK_S - 0.5:
            return None
        information = max(self._information, 1e-9)
        # A wearer who pushes at one joint is no heavier arm: what the weight does not explain widens the interval.
        unexplained = (self._squares - self._weighted**2 / information) / max(self._count - 1, 1)
        own = self._own / information  # the model's error is the same in all rows, with the worst signs
        sd = float(np.hypot(np.sqrt(max(unexplained, 1.0) / information), own))
        result = ScaleCheck(-self._weighted / information, sd, self._stuck / information)
        self._begin()
        return result

    def _begin(self) -> None:
        self._information = self._weighted = self._own = self._squares = self._relaxed_s = 0.0
        self._stuck, self._count = 0.0, 0
