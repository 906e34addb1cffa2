"""Sequential test of the residual torque of each joint: is it too large for longer than chance or a push explains?"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float

from exograv.identification.core.noise import Noise

from .alarm_rate import Joints, threshold_of, variance_rate

SURE_SD = 2.0
"""Multiple of the model's standard deviation that is not added up [-]. An error of the model lasts, so no time averages
it. An error beyond two standard deviations raises the rate of false alarms, and one beyond that and the bound gives an
alarm in any case: with the smallest bound, that is four standard deviations of a usual arm."""

BLOCK_S = 1.0
"""Duration of the means from which the size of the wearer's slow torque is estimated [s]."""

MEMORY_S = 60.0
"""Time constant of that estimate [s]."""

BURST = 4.0
"""Largest squared difference in that estimate over its present value [-]. An arm that falls once by a fault is no
restless wearer."""

LASTS_S = 2.0
"""Time for which a residual has to be too large, without an equally large one of the other sign, before it gives an
alarm [s]. The push of a wearer who moves to and fro at 0.25 Hz or faster changes its sign earlier (assumed). The size
of the slow torque follows such a wearer only after many blocks; until then, the threshold of the sum is too low."""

USUAL_BLOCKS = 10.0
"""Weight of the assumed size in that estimate, as a number of blocks [-]."""


@dataclass(frozen=True)
class Bound:
    """Residual torque above which the sum of a CUSUM test grows, and the test's rate of false alarms."""

    torque_Nm: Joints
    """Allowance in addition to friction and to the interval of the model (joint,) [N·m]."""

    mean_s: float
    """Mean time between false alarms of all joints and both signs together [s]."""


class ResidualTest:
    """Two-sided CUSUM tests of all joints, one per bound."""

    def __init__(self, noise: Noise, bounds: tuple[Bound, ...]):
        """Begin without a sample; the first size of the wearer's slow torque is that of `noise`."""
        self._noise, self._bounds = noise, bounds
        joints = len(noise.sd)
        self._sums = np.zeros((len(bounds), 2, joints))
        self._lasts_s = np.zeros_like(self._sums)
        self._since_s, self._total = np.zeros((2, joints)), np.zeros((2, joints))
        self._variance, self._weight = noise.disturbance_sd**2, USUAL_BLOCKS
        self._block, self._block_s, self._before = np.zeros((2, joints)), 0.0, None
        self._set_thresholds()

    @property
    def scale(self) -> Joints:
        """Size of the wearer's slow torque over the assumed size (joint,) [-]; at least 1."""
        return np.sqrt(self._variance) / self._noise.disturbance_sd

    def restart(self) -> None:
        """Begin a new motion. The size of the wearer's slow torque stays known."""
        self._sums[:] = self._lasts_s[:] = 0.0
        self._since_s[:] = self._total[:] = 0.0
        self._block[:], self._block_s, self._before = 0.0, 0.0, None

    def take(self, dt: float, residual: Joints, friction: Joints, sd: Joints, may_rise: Bool[np.ndarray, "2 joint"]):
        """Add one sample.

        Args:
            dt: Time since the previous sample [s].
            residual: Measured torque minus the torque of the model (joint,) [N·m].
            friction: Torque that friction may hide or add at this motion (joint,) [N·m]; infinite if nothing is known.
            sd: Standard deviation of the model's torque (joint,) [N·m].
            may_rise: False for a sign (first positive, then negative) and joint that something outside may load.
        """
        signed = np.array([residual, -residual])
        more = signed - (friction + SURE_SD * sd)
        known = np.isfinite(more) & may_rise
        self._add(dt, signed, np.where(known, more, 0.0), known)
        if np.isfinite(friction).all():
            self._measure(dt, residual)

    def beyond(self, level: int) -> int | None:
        """Joint with the clearest alarm at this bound; None if there is none."""
        lasting = np.where(self._lasts_s[level] >= LASTS_S, self._sums[level], 0.0)
        share = lasting.max(axis=0) / self._thresholds[level]
        joint = int(share.argmax())
        return joint if share[joint] >= 1.0 else None

    def mean(self, joint: int) -> float:
        """Mean residual of a joint since it began to be too large, by the sign that lasts longer [N·m]."""
        sign = int(self._sums[:, :, joint].max(axis=0).argmax())
        return float((1 - 2 * sign) * self._total[sign, joint] / max(self._since_s[sign, joint], 1e-9))

    def means(self) -> Joints:
        """Mean residual of each joint as in `mean` (joint,) [N·m]."""
        return np.array([self.mean(joint) for joint in range(self._sums.shape[2])])

    def _add(
        self,
        dt: float,
        signed: Float[np.ndarray, "2 joint"],
        more: Float[np.ndarray, "2 joint"],
        known: Bool[np.ndarray, "2 joint"],
    ) -> None:
        for sums, lasts_s, bound in zip(self._sums, self._lasts_s, self._bounds, strict=True):
            beyond = np.where(known, more - bound.torque_Nm, 0.0)
            sums += dt * beyond
            np.maximum(sums, 0.0, out=sums)
            has_turned = beyond[::-1] > 0.0
            lasts_s[:] = np.where((sums > 0.0) & ~has_turned, lasts_s + dt, 0.0)
        runs = self._sums.max(axis=0) > 0.0
        self._since_s = np.where(runs, self._since_s + dt, 0.0)
        self._total = np.where(runs, self._total + dt * signed, 0.0)

    def _measure(self, dt: float, residual: Joints) -> None:
        """Estimate the size of the slow torque from differences of means, which a lasting residual does not change.

        A wearer who pushes quickly also pushes slowly: the slow torque is no smaller than the changes within a block.
        """
        self._block += dt * np.array([residual, residual**2])
        self._block_s += dt
        if self._block_s < BLOCK_S - 0.5 * dt:
            return
        (mean, square), before = self._block / self._block_s, self._before
        self._before, self._block, self._block_s = mean, np.zeros_like(self._block), 0.0
        if before is None:
            return
        own = (mean - before) ** 2 / difference_share(BLOCK_S / self._noise.disturbance_correlation_s)
        own = np.minimum(np.maximum(own, square - mean**2), BURST * self._variance)
        keeps = np.exp(-BLOCK_S / MEMORY_S)
        usual = self._noise.disturbance_sd**2
        self._weight = min(self._weight + 1.0, 1.0 / (1.0 - keeps))
        self._variance = np.maximum(self._variance + (own - self._variance) / self._weight, usual)
        self._set_thresholds()

    def _set_thresholds(self) -> None:
        noise = self._noise
        rate = variance_rate(np.sqrt(self._variance), noise.disturbance_correlation_s)
        rate = rate + noise.sd**2 * noise.correlation_s
        tests = 2.0 * len(noise.sd)
        self._thresholds = np.array([threshold_of(tests * b.mean_s, b.torque_Nm, rate) for b in self._bounds])


def difference_share(a: float) -> float:
    """Variance of the difference of two neighbouring means of an Ornstein–Uhlenbeck noise, over its variance [-].

    Args:
        a: Duration of a mean over the correlation time [-].
    """
    of_mean = 2.0 * (a - 1.0 + np.exp(-a)) / a**2
    together = ((1.0 - np.exp(-a)) / a) ** 2
    return float(2.0 * (of_mean - together))
