"""Re-check of the arm's weight: how much heavier than its file does the arm look in the motion of the last seconds?"""

from dataclasses import dataclass

import numpy as np

from exograv.identification.core.noise import Noise

from .alarm_rate import Joints

BLOCK_S = 1.0
"""Duration of the means that enter as one row [s]."""

CHECK_S = 20.0
"""Time of motion after which a check ends and the next begins [s] (docs/explanation/safety.md, F48)."""

MOVES_RAD_S = 0.05
"""Joint speed below which a second is no motion, because friction hides the weight [rad/s]."""

SURE = 4.0
"""Standard errors by which the arm's weight must differ [-]: once in 16 000 checks of the right file by chance."""

DIFFERS = 0.15
"""Share of the arm's weight below which a difference is no other person [-]: a file may be a week old."""


@dataclass(frozen=True)
class ScaleCheck:
    """Result of one check."""

    excess: float
    """Weight of the arm beyond that of its file, as a share [-]."""

    sd: float
    """Standard error of `excess` [-]."""

    @property
    def is_contradicted(self) -> bool:
        """True if the arm is clearly heavier or lighter than its file."""
        return abs(self.excess) > DIFFERS + SURE * self.sd


class ArmScale:
    """Weighted regression of the residual torque on the torque of the arm, over all joints together."""

    def __init__(self, noise: Noise):
        """Begin the first check."""
        self._noise = noise
        self._rows, self._seconds = np.zeros((4, len(noise.sd))), 0.0
        self._fastest = np.zeros(len(noise.sd))
        self._begin()

    def restart(self) -> None:
        """Drop the present check, for example after a gap."""
        self._rows[:], self._seconds = 0.0, 0.0
        self._begin()

    def take(
        self, dt: float, residual: Joints, arm: Joints, v: Joints, friction: Joints, sd: Joints, scale: Joints
    ) -> ScaleCheck | None:
        """Add a sample; return the result at the end of a check.

        Args:
            dt: Time since the previous sample [s].
            residual: Measured torque minus the torque of the model (joint,) [N·m].
            arm: Torque of the arm alone, by the file (joint,) [N·m].
            v: Velocity (joint,) [rad/s].
            friction: Torque that friction may hide or add (joint,) [N·m].
            sd: Standard deviation of the model's torque (joint,) [N·m].
            scale: Size of the wearer's slow torque over the assumed size (joint,) [-].
        """
        self._rows += dt * np.array([residual, arm, np.where(np.isfinite(friction), friction, 1e3), sd])
        self._seconds += dt
        self._fastest = np.maximum(self._fastest, np.abs(v))
        if self._seconds < BLOCK_S - 0.5 * dt:
            return None
        mean_residual, mean_arm, mean_friction, mean_sd = self._rows / self._seconds
        moved = self._fastest > MOVES_RAD_S
        self._rows[:], self._seconds = 0.0, 0.0
        self._fastest[:] = 0.0
        if not moved.any():
            return None
        # A mean of the slow torque repeats the ones before: its variance counts as that of independent means.
        slow = 2.0 * (scale * self._noise.disturbance_sd) ** 2 * self._noise.disturbance_correlation_s / BLOCK_S
        variance = slow + mean_friction**2 / 3.0
        self._information += float((mean_arm**2 / variance)[moved].sum())
        self._weighted += float((mean_arm * mean_residual / variance)[moved].sum())
        self._own += float((mean_arm * mean_sd / variance)[moved].sum())
        self._motion_s += BLOCK_S
        if self._motion_s < CHECK_S - 0.5:
            return None
        information = max(self._information, 1e-9)
        # The error of the model is the same in all rows: its worst sum is that of all signs alike.
        result = ScaleCheck(
            -self._weighted / information, float(np.hypot(information**-0.5, self._own / information))
        )
        self._begin()
        return result

    def _begin(self) -> None:
        self._information = self._weighted = self._own = self._motion_s = 0.0
