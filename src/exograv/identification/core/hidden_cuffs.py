"""Cuffs beyond linear springs: hidden parameters for straps that stiffen and slip.

As the tissue's, these parameters are learned and never compensated. On the twin the effect of such cuffs on the weight
at rest is small beside what their slip does to the torque of a motion.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from .interface import Joints, Parameters, Sample, TorqueModel
from .tissue import CUFFS, Hidden, TissueModel

STIFFENS_AT_M, STIFFENING_SD = 0.015, 0.7
"""Strain [m], and standard deviation of the quadratic part of a cuff's force over the linear part there [-]. Published
cuffs stiffen with the strain (Schiebl 2025, Sensors 25:4605); the size is assumed."""

SLIPS_AT_M = (0.003, 0.006, 0.012)
"""Strains along the limb beyond which a part of a cuff slips [m]. Together the parts approximate any loop of dry
friction (Prandtl-Ishlinskii)."""

SLIP_SD = 0.4
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


class CuffModel:
    """Model of an arm with hidden parameters of its cuffs after all others.

    Force that a linear cuff does not give acts as a displacement of the cuff's rest place. The parts, in their order:

    - stiffening: displacement −e·abs(e) / `STIFFENS_AT_M` at a strain e, the same for the axes of a cuff;
    - slip: displacement along the limb by a play operator per threshold.
    """

    def __init__(self, arm: TorqueModel, tissue: TissueModel, cuffs: Cuffs):
        """Extend `tissue`, which is the model of `arm` with hidden parameters of its own."""
        self._arm, self._model, self._loads = arm, tissue, cuffs.loads
        self._count = cuffs.count * (1 + len(SLIPS_AT_M))
        sd = np.repeat([STIFFENING_SD, SLIP_SD], [cuffs.count, cuffs.count * len(SLIPS_AT_M)])
        self.hidden = Hidden(
            np.append(tissue.hidden.sd, sd), np.append(tissue.hidden.group, np.full(self._count, CUFFS))
        )
        """Prior of all hidden parameters."""
        self.n_joints, self.n_parameters = tissue.n_joints, tissue.n_parameters + self._count
        self._nowhere = np.zeros((cuffs.count, len(SLIPS_AT_M)))
        self._slipped = self._nowhere

    def restart(self) -> None:
        """Start a new motion, with the cuffs where they were fastened."""
        self._model.restart()
        self._slipped = self._nowhere

    def direction_uncertainty(self, v: Joints) -> Joints:
        """Return the standard deviation of the torque [N·m], as of the arm model."""
        return self._model.direction_uncertainty(v)

    def linearise(self, sample: Sample, x: Parameters) -> tuple[Joints, Float[np.ndarray, "joint parameter"]]:
        """Return the expected torque (joint,) [N·m] and its derivative; call for the samples of a motion in order."""
        tau, derivative = self._model.linearise(sample, x[: -self._count])
        loads = self._loads(self._arm)
        C, e = loads.by_displacement, loads.strain
        along = e[:, ALONG, None]
        self._slipped = np.clip(self._slipped, along - SLIPS_AT_M, along + SLIPS_AT_M)
        stiffened = -(C * (e * np.abs(e))).sum(axis=2) / STIFFENS_AT_M
        slipped = C[:, :, ALONG, None] * self._slipped
        columns = np.hstack([stiffened, slipped.reshape(len(tau), -1)])
        return tau + columns @ x[-self._count :], np.hstack([derivative, columns])
