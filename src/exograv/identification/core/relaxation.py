"""Stress relaxation of tissue: a part of each joint's elastic torque that decays after the joint has moved."""

import numpy as np
from jaxtyping import Float

from .interface import Joints, Parameters, Sample, TorqueModel

RELAXES_S = 1.0
"""Time constant of the decaying part of a relaxed joint's elasticity [s] (docs/explanation/arm.md)."""

SHARE_SD = 0.3
"""Standard deviation of that part over the permanent elasticity [-]; the project's ranges are 0 to 0.5."""


class RelaxationModel:
    """Model of an arm with one more parameter per spring, after all others: its fast stiffness [N·m/rad].

    Without it, torque that decays within a second is learned as damping and stiffness, with more confidence the longer
    the motion lasts. On a machine with little friction this is the largest error of both. The law is a standard linear
    solid: the spring torque of `model`, passed through a high-pass filter.
    """

    def __init__(self, model: TorqueModel, stiffness: slice):
        self._model, self._stiffness = model, stiffness
        self._count = stiffness.stop - stiffness.start
        self.n_joints, self.n_parameters = model.n_joints, model.n_parameters + self._count
        self._t: float | None = None
        self._relaxed = np.zeros((model.n_joints, self._count))

    def linearise(self, sample: Sample, x: Parameters) -> tuple[Joints, Float[np.ndarray, "joint parameter"]]:
        """Return the expected torque (joint,) [N·m] and its derivative; call for the samples of a motion in order."""
        tau, derivative = self._model.linearise(sample, x[: -self._count])
        stretched = derivative[:, self._stiffness]
        if self._t is None:
            self._relaxed = stretched.copy()
        else:
            # Exact decay over the step, with the stretch held at its new value.
            self._relaxed += (1.0 - np.exp((self._t - sample.t) / RELAXES_S)) * (stretched - self._relaxed)
        self._t = sample.t
        fast = stretched - self._relaxed
        return tau + fast @ x[-self._count :], np.hstack([derivative, fast])

    def restart(self) -> None:
        """Start a new motion, with the tissue relaxed."""
        self._model.restart()
        self._t = None

    def direction_uncertainty(self, v: Joints) -> Joints:
        """Return the standard deviation of the torque [N·m], as of the arm model."""
        return self._model.direction_uncertainty(v)
