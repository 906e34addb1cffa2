"""What one joint's passes say of what is left over there, weighed over all that is not known of the wearer's unrest."""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from jaxtyping import Float

from exograv.identification.core.square_root import GATE, square_root
from exograv.identification.recursive.recursive import USUAL_SCALES
from exograv.procedures.weighing.slow_torque import Belief, Information, RegressionRows, believed, motion_information

CORRELATIONS_S = (1.5, 3.0, 5.0)
"""Of the slow torque that are held possible; people: 1-5 s (docs/arm.md)."""

SIZES_NM = np.geomspace(0.02, 5.0, 8)
"""Held possible of what a posture is off by of its own: from a calibration's rest to the weight of a forearm [N·m]."""

STEPS = 2
"""The second knows which samples surprise."""

NOTHING, ANYTHING = 1e-9, 1e3
"""Variance of what is taken as known, and of what is not [-]."""

Weights = Float[np.ndarray, " belief"]


@dataclass(frozen=True)
class Unknowns:
    """Where each kind is among a joint's unknowns; all but the own ones have a standard deviation of one."""

    arm: slice
    """What the identification is off by."""

    own: slice
    """Each posture's own [N·m]."""

    turning: slice
    """Of friction: turns its sign with the motion, one at each posture."""

    constant: slice
    """Of friction: by how much its two directions differ."""

    @classmethod
    def of(cls, arm: int, postures: int) -> "Unknowns":
        """In this order."""
        own, turning = arm + postures, arm + 2 * postures
        return cls(slice(0, arm), slice(arm, own), slice(own, turning), slice(turning, turning + 1))


@dataclass(frozen=True)
class JointPasses:
    """All samples of one joint, and what its torque may be off by."""

    rows: RegressionRows
    unknowns: Unknowns
    slow_sd: float
    """Usual size of the wearer's slow torque [N·m]."""

    def draw(
        self, to_torque: Float[np.ndarray, "posture unknown"], count: int, random: np.random.Generator
    ) -> Float[np.ndarray, "draw posture"]:
        """Possible torques at the postures, all alike probable [N·m]; `to_torque` is of the arm's and the own ones."""
        known, found = slice(0, self.unknowns.own.stop), []
        for belief, times in zip(self._beliefs, random.multinomial(count, self._weights), strict=True):
            if times:
                spread = to_torque @ square_root(belief.covariance[known, known])
                drawn = random.standard_normal((times, spread.shape[1])) @ spread.T
                found.append(to_torque @ belief.mean[known] + drawn)
        return random.permutation(np.vstack(found))

    def beyond(self) -> tuple[Float[np.ndarray, " posture"], Float[np.ndarray, " posture"]]:
        """Each posture's own torque where the model is taken as it is and nothing else believed, and its SD [N·m]."""
        variance = np.ones(self.unknowns.constant.stop)
        variance[self.unknowns.arm] = variance[self.unknowns.constant] = NOTHING
        variance[self.unknowns.own] = ANYTHING
        belief = believed(self._information, np.zeros(len(variance)), variance)
        return belief.mean[self.unknowns.own], np.sqrt(np.diag(belief.covariance)[self.unknowns.own])

    @property
    def noise_scale(self) -> float:
        """How restless the wearer was here, against the assumed size [-]."""
        return float(self._weights @ np.tile(USUAL_SCALES, len(SIZES_NM) * len(CORRELATIONS_S)))

    @cached_property
    def surprising(self) -> Float[np.ndarray, " sample"]:
        """Of each sample, how many standard deviations it is off [-]."""
        likely = self._beliefs[int(self._weights.argmax())]
        off = self.rows.y[:, 0] - self.rows.H[:, 0] @ likely.mean
        return np.abs(off) / np.hypot(self.rows.noise[:, 0], self.noise_scale * self.slow_sd)

    @cached_property
    def _learned(self) -> tuple[list[Information], list[Belief], Weights]:
        """What the data say under each assumption about the slow torque, and what is believed for each own size."""
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
    """Of the samples in which some joint surprises by more than twice what is taken in full [-]."""
    return float((np.array([joint.surprising for joint in joints]) > 2 * GATE).any(axis=0).mean())
