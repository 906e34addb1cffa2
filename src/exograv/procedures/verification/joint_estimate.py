"""Estimate of the left over of one joint, averaged over the possible sizes of the wearer's unrest."""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from jaxtyping import Float

from exograv.identification.core.square_root import GATE, square_root
from exograv.identification.recursive.recursive import USUAL_SCALES
from exograv.procedures.weighing.slow_torque import Belief, Information, RegressionRows, believed, motion_information

CORRELATIONS_S = (1.5, 3.0, 5.0)
"""Possible correlation times of the slow torque [s]; people have 1-5 s (docs/explanation/arm.md)."""

SIZES_NM = np.geomspace(0.02, 5.0, 8)
"""Possible sizes of a posture's own error [N·m]: from the residual of a calibration to the weight of a forearm."""

STEPS = 2
"""Number of steps; the second one knows the samples with unusual errors."""

NOTHING, ANYTHING = 1e-9, 1e3
"""Prior variance of a known and of a free unknown [-]."""

Weights = Float[np.ndarray, " belief"]


@dataclass(frozen=True)
class Unknowns:
    """Slices of a joint's unknowns by kind. All but `own` are scaled to a standard deviation of one."""

    arm: slice
    """Errors of the identification."""

    own: slice
    """Own error of each posture [N·m]."""

    turning: slice
    """Friction errors that change their sign with the motion, one per posture."""

    constant: slice
    """Friction error that does not: the difference of the two directions."""

    @classmethod
    def of(cls, arm: int, postures: int) -> "Unknowns":
        """Return the slices for `arm` parameters of the arm and this number of postures, in the order of the fields."""
        own, turning = arm + postures, arm + 2 * postures
        return cls(slice(0, arm), slice(arm, own), slice(own, turning), slice(turning, turning + 1))


@dataclass(frozen=True)
class JointPasses:
    """Samples of one joint in all passes, with the unknowns of its torque."""

    rows: RegressionRows
    unknowns: Unknowns
    slow_sd: float
    """Usual size of the wearer's slow torque [N·m]."""

    def draw(
        self, to_torque: Float[np.ndarray, "posture unknown"], count: int, random: np.random.Generator
    ) -> Float[np.ndarray, "draw posture"]:
        """Draw possible torques at the postures, all equally probable [N·m].

        `to_torque` maps the unknowns of arm and postures to torques.
        """
        known, found = slice(0, self.unknowns.own.stop), []
        for belief, times in zip(self._beliefs, random.multinomial(count, self._weights), strict=True):
            if times:
                spread = to_torque @ square_root(belief.covariance[known, known])
                drawn = random.standard_normal((times, spread.shape[1])) @ spread.T
                found.append(to_torque @ belief.mean[known] + drawn)
        return random.permutation(np.vstack(found))

    def beyond(self) -> tuple[Float[np.ndarray, " posture"], Float[np.ndarray, " posture"]]:
        """Return each posture's own torque and its standard deviation [N·m].

        The model counts as exact, and the own torques have no prior.
        """
        variance = np.ones(self.unknowns.constant.stop)
        variance[self.unknowns.arm] = variance[self.unknowns.constant] = NOTHING
        variance[self.unknowns.own] = ANYTHING
        belief = believed(self._information, np.zeros(len(variance)), variance)
        return belief.mean[self.unknowns.own], np.sqrt(np.diag(belief.covariance)[self.unknowns.own])

    @property
    def noise_scale(self) -> float:
        """Size of the wearer's unrest at this joint, relative to the assumed size [-]."""
        return float(self._weights @ np.tile(USUAL_SCALES, len(SIZES_NM) * len(CORRELATIONS_S)))

    @cached_property
    def surprising(self) -> Float[np.ndarray, " sample"]:
        """Absolute error of each sample, in standard deviations [-]."""
        likely = self._beliefs[int(self._weights.argmax())]
        off = self.rows.y[:, 0] - self.rows.H[:, 0] @ likely.mean
        return np.abs(off) / np.hypot(self.rows.noise[:, 0], self.noise_scale * self.slow_sd)

    @cached_property
    def _learned(self) -> tuple[list[Information], list[Belief], Weights]:
        """Information for each assumption on the slow torque, beliefs for each own size, and their weights."""
        information: list[Information] = []
        beliefs: list[Belief] = []
        weights, expected = np.zeros(0), None
        for _ in range(STEPS):
            slow = np.array([self.slow_sd])
            information = [one for s in CORRELATIONS_S for one in motion_information([self.rows], slow, expected, s)]
            beliefs = list(self._believed(information))
            logs = np.array([belief.log_evidence for belief in beliefs])
            weights = np.exp(logs - logs.max())
            weights /= weights.sum()
            expected = weights @ np.array([belief.mean for belief in beliefs])
        return information, beliefs, weights

    def _believed(self, information: list[Information]) -> Iterator[Belief]:
        variance = np.ones(self.unknowns.constant.stop)
        for size in SIZES_NM:
            variance[self.unknowns.own] = size**2
            yield from (believed([one], np.zeros(len(variance)), variance.copy()) for one in information)

    @property
    def _information(self) -> list[Information]:
        return self._learned[0]

    @property
    def _beliefs(self) -> list[Belief]:
        return self._learned[1]

    @property
    def _weights(self) -> Weights:
        return self._learned[2]


def rejected_share(joints: list[JointPasses]) -> float:
    """Share of the samples in which the error of a joint is more than twice the limit of full weight [-]."""
    return float((np.array([joint.surprising for joint in joints]) > 2 * GATE).any(axis=0).mean())
