"""Tissue that yields: a part of each joint's elastic torque that is there when the joint has moved, and fades."""

import numpy as np
from jaxtyping import Float

from .interface import Joints, Parameters, Sample, TorqueModel

RELAXES_S = 1.0
"""In which the fast part of a relaxed joint's elasticity fades [s] (docs/arm.md)."""

SHARE_SD = 0.3
"""Of that part, against the elasticity that stays [-]: project ranges reach from none to a half."""


class RelaxationModel:
    """`TorqueModel` of an arm with one more parameter a spring, behind all others: its fast stiffness [N·m/rad].

    Without it what fades within a second is learned as damping and as stiffness, the surer the longer the motion: on
    a machine with little friction of its own that is the largest error of both. A standard linear solid; its springs'
    torque is the model's own, passed through a high-pass filter.
    """

    def __init__(self, model: TorqueModel, stiffness: slice):
        self._model, self._stiffness = model, stiffness
        self._count = stiffness.stop - stiffness.start
        self.n_joints, self.n_parameters = model.n_joints, model.n_parameters + self._count
        self._t: float | None = None
        self._relaxed = np.zeros((model.n_joints, self._count))

    def linearise(self, sample: Sample, x: Parameters) -> tuple[Joints, Float[np.ndarray, "joint parameter"]]:
        """Expected torque (joint,) [N·m] and its derivative; the samples of a motion one after the other."""
        tau, derivative = self._model.linearise(sample, x[: -self._count])
        stretched = derivative[:, self._stiffness]
        if self._t is None:
            self._relaxed = stretched.copy()
        else:
            # Within a step the stretch goes evenly from what it was to what it is.
            self._relaxed += (1.0 - np.exp((self._t - sample.t) / RELAXES_S)) * (stretched - self._relaxed)
        self._t = sample.t
        fast = stretched - self._relaxed
        return tau + fast @ x[-self._count :], np.hstack([derivative, fast])

    def restart(self) -> None:
        """The next sample does not follow the one before; by then the tissue has relaxed."""
        self._model.restart()
        self._t = None

    def direction_uncertainty(self, v: Joints) -> Joints:
        """As of the arm."""
        return self._model.direction_uncertainty(v)
