"""Left over: RMS residual gravity torque after identification, as predicted from the estimate's covariance."""

from collections.abc import Sequence

import numpy as np
from jaxtyping import Float

from exograv.dynamics.parameters import ParameterLayout
from exograv.model.rig_settings import Place
from exograv.model.support import sample_postures

from .arm_model import ArmModel
from .hidden_cuffs import ALONG
from .interface import RESTLESS, Agreement, Covariance, Estimate, Joints, Outcome, Parameters

TARGET_NM = {"shoulder": 0.2, "elbow": 0.1, "wrist": 0.05}
"""Predicted left over, discrepancy included, at which identification may stop, by place of the joint [N·m]."""

PostureTorque = Float[np.ndarray, "posture joint"]

POSTURES = 32
LOOK_AHEAD_S = 10.0
WORTHWHILE = 0.05  # share by which the look-ahead must still improve the prediction

REJECTED_MAX = 0.3
"""Largest share of samples that fit no relaxed arm [-]; a wearer above it does not relax."""


def is_restless(estimate: Estimate) -> bool:
    """Return True if the wearer does not relax; always False in the first 10 s, which have too few samples."""
    if estimate.t <= LOOK_AHEAD_S:
        return False
    return estimate.rejected_share > REJECTED_MAX or estimate.noise_scale > RESTLESS


class LeftOverPrediction:
    """Prediction of the RMS torque error over the task workspace, for any covariance of the parameters."""

    def __init__(self, model: ArmModel, x: Parameters):
        postures = sample_postures(model.assembly.description, POSTURES)
        relevant = np.zeros(model.n_parameters, dtype=bool)
        layout = ParameterLayout.of(model.assembly)
        relevant[layout.phi] = relevant[layout.fit] = True
        rows, by_slip = [], []
        for q in postures:
            rows.append(np.where(relevant, model.at_rest(q, x)[1], 0.0))
            by_slip.append(model.cuff_loads().by_displacement[:, :, ALONG])
        self._sensitivity: Float[np.ndarray, "posture joint parameter"] = np.array(rows)
        self._by_slip: Float[np.ndarray, "posture joint cuff"] = np.array(by_slip)

    def of(self, estimate: Estimate) -> Joints | None:
        """Left over (joint,) that an estimate predicts for itself [N·m]; None if it states no uncertainty.

        The compensation counts on cuffs where they were fastened. The torque of their slip is therefore left over.
        """
        if estimate.covariance is None:
            return None
        return np.hypot(self.rms(estimate.covariance), self.by_slip(estimate))

    def by_slip(self, estimate: Estimate) -> Joints:
        """Torque of the cuffs' slip over motion and task workspace, RMS (joint,) [N·m]."""
        slipped = estimate.slipped
        if slipped is None or not len(slipped):
            return np.zeros(self._by_slip.shape[1])
        return np.sqrt(np.mean(self._by_slip**2, axis=0) @ slipped**2)

    def torque_of(self, difference: Parameters) -> PostureTorque:
        """Torque of a difference between two parameter vectors, by posture and joint [N·m]."""
        return self._sensitivity @ difference

    def parts_of(self, difference: Parameters) -> Float[np.ndarray, "posture joint parameter"]:
        """Torque of each parameter's part of a difference, by posture and joint [N·m]."""
        return self._sensitivity * difference

    def sd_along(self, torque: PostureTorque, covariance: Covariance) -> Joints:
        """Return the standard deviation of the torque error along a torque over the postures (joint,) [N·m]."""
        size = np.sqrt(np.mean(torque**2, axis=0))
        direction = torque / np.maximum(size, 1e-12)
        rows = np.einsum("pj,pji->ji", direction, self._sensitivity) / len(torque)
        return np.sqrt(np.maximum(np.einsum("ji,ik,jk->j", rows, covariance, rows), 0.0))

    def rms(self, covariance: Covariance) -> Joints:
        """Predicted left over (joint,) [N·m]."""
        C = self._sensitivity
        return np.sqrt(np.einsum("pji,ik,pjk->j", C, covariance, C, optimize=True) / len(C))


class StopRule:
    """Rule that ends an identification, with the reason."""

    def __init__(self, places: Sequence[Place], joints: Sequence[str]):
        self._joints = joints
        self._target = np.array([TARGET_NM[place] for place in places])
        self._history: list[tuple[float, float]] = []

    def judge(self, estimate: Estimate, predicted: Joints) -> Outcome:
        """Return the outcome after this much motion; `RUNNING` until a rule applies. Call about once per second."""
        # The joint farthest from its target decides: one number, 1 at the target.
        ratio = float((predicted / self._target).max())
        self._history.append((estimate.t, ratio))
        if estimate.rejected_share > REJECTED_MAX and is_restless(estimate):
            return Outcome.NOT_RELAXED
        # Not earlier: a prior from another day may be certain without evidence from today (docs/howto/participants.md).
        if ratio <= 1.0 and estimate.t >= LOOK_AHEAD_S:
            return Outcome.UNCHECKED
        earlier = [r for t, r in self._history if t <= estimate.t - LOOK_AHEAD_S]
        # The motion repeats: the next seconds bring at most as much information as the last ones did.
        if estimate.t >= 2 * LOOK_AHEAD_S and earlier and ratio > (1 - WORTHWHILE) * earlier[-1]:
            # With a restless wearer the stagnation does not come from the motion.
            return Outcome.NOT_RELAXED if is_restless(estimate) else Outcome.EXHAUSTED
        return Outcome.RUNNING

    def final(
        self, outcome: Outcome, estimate: Estimate, predicted: Joints, agreement: Agreement | None = None
    ) -> Outcome:
        """Return the outcome of the final estimate, which all samples have changed since the rule applied.

        Only a check at unused postures makes an estimate within its target a converged one.
        """
        if outcome not in (Outcome.UNCHECKED, Outcome.EXHAUSTED, Outcome.TIME_IS_UP):
            return outcome
        # As in `judge`, a belief from another day is no evidence of today.
        if estimate.t < LOOK_AHEAD_S or not (predicted <= self._target).all():
            return Outcome.EXHAUSTED if outcome is Outcome.UNCHECKED else outcome
        if agreement is None:
            return Outcome.UNCHECKED
        return Outcome.CONVERGED if agreement.holds else Outcome.DISAGREES

    def why(self, predicted: Joints) -> str:
        """State the figures behind the outcome in a sentence."""
        worst = int((predicted / self._target).argmax())
        numbers = ", ".join(f"{value:.2f}" for value in predicted)
        return (
            f"Predicted left over: {numbers} N·m. Joint {self._joints[worst]} is farthest from its target: "
            f"{predicted[worst]:.2f} of {self._target[worst]:.3g} N·m."
        )
