"""Cuffs that slip along the limb: hidden parameters, which are learned and never compensated.

Slip moves the arm in the machine. Without these parameters its torque would be learned as weight.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol, runtime_checkable

import numpy as np
from jaxtyping import Float

from .interface import Joints, Parameters, Sample, TorqueModel
from .tissue import CUFFS, Hidden, TissueModel

SLIPS_AT_M = (0.006, 0.012)
"""Strains along the limb beyond which a part of a cuff slips [m]. Assumed."""

SLIP_SD = 0.3
"""Standard deviation of the share of each part in the slip [-]. Assumed."""

ALONG = 2
"""Axis of a cuff's frame that points along the limb."""


@dataclass(frozen=True)
class CuffLoads:
    """Effect of a cuff's displacement on the torque, and strain of each cuff."""

    by_displacement: Float[np.ndarray, "joint cuff 3"]
    """Torque per displacement of the cuff's rest place on the machine, in the cuff's axes [N·m/m]."""

    strain: Float[np.ndarray, "cuff 3"]
    """Displacement of the limb from the rest place, in the cuff's axes [m]."""


@dataclass(frozen=True)
class Cuffs:
    """Cuffs between machine and wearer."""

    count: int
    loads: Callable[[TorqueModel], CuffLoads]
    """Function that returns the loads of the sample that this model linearised last."""


@runtime_checkable
class Slipping(Protocol):
    """Model that knows how far the cuffs have slipped."""

    def slipped(self, x: Parameters) -> Float[np.ndarray, " cuff"]:
        """Return the distance by which each cuff has slipped along the limb, RMS over the motion [m]."""
        ...


class CuffModel:
    """Model of an arm with hidden parameters of its cuffs after all others.

    Each cuff has parts that slip beyond a strain of their own: play operators (Prandtl-Ishlinskii). Their sum displaces
    the cuff's rest place along the limb, and approximates a loop of dry friction.
    """

    def __init__(self, arm: TorqueModel, tissue: TissueModel, cuffs: Cuffs):
        """Extend `tissue`, which is the model of `arm` with hidden parameters of its own."""
        self._arm, self._model, self._loads = arm, tissue, cuffs.loads
        self._count = cuffs.count * len(SLIPS_AT_M)
        sd = np.full(self._count, SLIP_SD)
        self.hidden = Hidden(
            np.append(tissue.hidden.sd, sd), np.append(tissue.hidden.group, np.full(self._count, CUFFS))
        )
        """Prior of all hidden parameters."""
        self.n_joints, self.n_parameters = tissue.n_joints, tissue.n_parameters + self._count
        self._nowhere = np.zeros((cuffs.count, len(SLIPS_AT_M)))
        self._forget()

    def _forget(self) -> None:
        self._slipped, self._samples = self._nowhere, 0
        self._squares = np.zeros((*self._nowhere.shape, self._nowhere.shape[1]))
        """Products of the slips of the parts of each cuff, summed over the samples [m²]."""

    def restart(self) -> None:
        """Start a new motion, with the cuffs where they were fastened."""
        self._model.restart()
        self._forget()

    def direction_uncertainty(self, v: Joints) -> Joints:
        """Return the standard deviation of the torque [N·m], as of the arm model."""
        return self._model.direction_uncertainty(v)

    def slipped(self, x: Parameters) -> Float[np.ndarray, " cuff"]:
        """Return the distance by which each cuff has slipped along the limb, RMS over the motion [m]."""
        parts = x[-self._count :].reshape(self._slipped.shape)
        return np.sqrt(np.einsum("cm,cmn,cn->c", parts, self._squares, parts) / max(self._samples, 1))

    def linearise(self, sample: Sample, x: Parameters) -> tuple[Joints, Float[np.ndarray, "joint parameter"]]:
        """Return the expected torque (joint,) [N·m] and its derivative; call for the samples of a motion in order."""
        tau, derivative = self._model.linearise(sample, x[: -self._count])
        columns = np.zeros((len(tau), self._count))
        # Without a closed posture the arm model returns zeros, and its strains have no meaning.
        if derivative.any():
            loads = self._loads(self._arm)
            along = loads.strain[:, ALONG, None]
            self._slipped = np.clip(self._slipped, along - SLIPS_AT_M, along + SLIPS_AT_M)
            self._squares += self._slipped[:, :, None] * self._slipped[:, None]
            self._samples += 1
            columns[:] = (loads.by_displacement[:, :, ALONG, None] * self._slipped).reshape(len(tau), -1)
        return tau + columns @ x[-self._count :], np.hstack([derivative, columns])
