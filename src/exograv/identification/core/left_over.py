"""Left over: RMS residual gravity torque after identification, as predicted from the estimate's covariance."""

from collections.abc import Sequence

import numpy as np
from jaxtyping import Float

from exograv.dynamics.parameters import ParameterLayout
from exograv.model.rig_settings import Place
from exograv.model.support import sample_postures

from .arm_model import ArmModel
from .interface import Covariance, Estimate, Joints, Outcome, Parameters

TARGET_NM = {"shoulder": 0.2, "elbow": 0.1, "wrist": 0.05}
"""Predicted left over, discrepancy included, at which identification may stop, by place of the joint [N·m]."""

POSTURES = 32
LOOK_AHEAD_S = 10.0
WORTHWHILE = 0.05  # share by which the look-ahead must still improve the prediction

RESTLESS = 2.0
"""Slow torque over its usual size [-]; a wearer above it does not relax."""

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
        rows = [np.where(relevant, model.at_rest(q, x)[1], 0.0) for q in postures]
        self._sensitivity: Float[np.ndarray, "posture joint parameter"] = np.array(rows)

    def rms(self, covariance: Covariance) -> Joints:
        """Predicted left over (joint,) [N·m]."""
        C = self._sensitivity
        return np.sqrt(np.einsum("pji,ik,pjk->j", C, covariance, C, optimize=True) / len(C))


class StopRule:
    """Rule that ends an identification, with the reason."""

    def __init__(self, places: Sequence[Place]):
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
            return Outcome.CONVERGED
        earlier = [r for t, r in self._history if t <= estimate.t - LOOK_AHEAD_S]
        # The motion repeats: the next seconds bring at most as much information as the last ones did.
        if estimate.t >= 2 * LOOK_AHEAD_S and earlier and ratio > (1 - WORTHWHILE) * earlier[-1]:
            # With a restless wearer the stagnation does not come from the motion.
            return Outcome.NOT_RELAXED if is_restless(estimate) else Outcome.EXHAUSTED
        return Outcome.RUNNING

    def final(self, outcome: Outcome, estimate: Estimate, predicted: Joints) -> Outcome:
        """Return the outcome of the final estimate, which all samples have changed since the rule applied."""
        # As in `judge`, a belief from another day is no evidence of today.
        converged = estimate.t >= LOOK_AHEAD_S and bool((predicted <= self._target).all())
        if outcome is Outcome.CONVERGED and not converged:
            return Outcome.EXHAUSTED
        if outcome in (Outcome.EXHAUSTED, Outcome.TIME_IS_UP) and converged:
            return Outcome.CONVERGED
        return outcome

    def why(self, predicted: Joints, joints: Sequence[str]) -> str:
        """State the figures behind the outcome in a sentence."""
        worst = int((predicted / self._target).argmax())
        numbers = ", ".join(f"{value:.2f}" for value in predicted)
        return (
            f"Predicted left over: {numbers} N·m. Joint {joints[worst]} is farthest from its target: "
            f"{predicted[worst]:.2f} of {self._target[worst]:.3g} N·m."
        )
