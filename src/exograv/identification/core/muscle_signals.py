"""Signals of the wearer's muscles (EMG): hidden parameters map them to torque, and are never compensated.

The map from the signals to torque is unknown and is learned beside the arm. The machine moves the arm, so the torque of
the muscles does not repeat with the posture. What the signals do not explain stays in the slow disturbance.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from .hidden_cuffs import Slipping
from .interface import Joints, Parameters, Sample, TorqueModel
from .tissue import FIXED, Hidden

CONTRACTION_NM = 60.0
"""Torque of a maximum voluntary contraction at shoulder or elbow [N·m]: the order of healthy adults. It is the standard
deviation of the map, so a third or three times of it is learned from the motion."""


@dataclass(frozen=True)
class MuscleSignals:
    """Measured signals of the wearer's muscles, as `Sample.muscles` has them."""

    channels: int

    torque_Nm: float = CONTRACTION_NM
    """Standard deviation of the torque of each joint at a whole contraction of each channel [N·m]; the sign is
    unknown."""


class MuscleModel:
    """Model of an arm with the map from muscle signals to torque after all other parameters.

    A muscle torque replaces torque of the motors. The expected torque is therefore that of the arm minus the map's.
    """

    def __init__(self, model: TorqueModel, hidden: Hidden | None, signals: MuscleSignals):
        """Extend `model`, whose own hidden parameters have the prior `hidden`."""
        self._model, self._channels = model, signals.channels
        self.n_joints = model.n_joints
        self._count = self.n_joints * self._channels
        self.n_parameters = model.n_parameters + self._count
        sd, group = (np.zeros(0), np.zeros(0, dtype=int)) if hidden is None else (hidden.sd, hidden.group)
        self.hidden = Hidden(
            np.append(sd, np.full(self._count, signals.torque_Nm)), np.append(group, np.full(self._count, FIXED))
        )
        """Prior of all hidden parameters."""

    def restart(self) -> None:
        """Start a new motion."""
        self._model.restart()

    def direction_uncertainty(self, v: Joints) -> Joints:
        """Return the standard deviation of the torque [N·m], as of the arm model."""
        return self._model.direction_uncertainty(v)

    def slipped(self, x: Parameters) -> Float[np.ndarray, " cuff"]:
        """Return the distance by which each cuff has slipped along the limb, RMS over the motion [m]."""
        return self._model.slipped(x[: -self._count]) if isinstance(self._model, Slipping) else np.zeros(0)

    def linearise(self, sample: Sample, x: Parameters) -> tuple[Joints, Float[np.ndarray, "joint parameter"]]:
        """Return the expected torque (joint,) [N·m] and its derivative; without signals, that of silent muscles."""
        tau, derivative = self._model.linearise(sample, x[: -self._count])
        columns = np.zeros((len(tau), self._count))
        # Without a closed posture the arm model returns zeros, and the sample must teach nothing.
        if sample.muscles is not None and derivative.any():
            for joint, row in enumerate(columns):
                row[joint * self._channels : (joint + 1) * self._channels] = -sample.muscles
        return tau + columns @ x[-self._count :], np.hstack([derivative, columns])
