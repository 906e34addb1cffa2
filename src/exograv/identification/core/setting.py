"""Common start of all identification methods: the same model, prior and noise."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool

from .discrepancy import Discrepancy
from .hidden_cuffs import Cuffs
from .interface import Covariance, Joints, Parameters, TorqueModel
from .muscle_signals import MuscleSignals
from .noise import Noise
from .path_discrepancy import PathDiscrepancy
from .tissue import Springs

RESIDUAL_MIN_NM = 0.01


@dataclass(frozen=True)
class Setting:
    """Start of an identification: an arm in a machine, or a payload on a robot, before any motion."""

    model: TorqueModel

    mean: Parameters
    """Prior mean; every method starts there."""

    covariance: Covariance
    """Prior covariance; parameters with zero variance are known."""

    noise: Noise

    bodies: tuple[slice, ...]
    """Inertial parameters of the bodies that are learned."""

    learned: Bool[np.ndarray, " parameter"]
    """Parameters that a method without a covariance may change. On a robot with a payload: only the payload, because
    such a method cannot know how little the robot differs from its unloaded log."""

    machine: Bool[np.ndarray, " parameter"]
    """Parameters that stage 0, the calibration of the machine, has identified; a method in stages keeps them."""

    discrepancy: Discrepancy | None = None

    path: PathDiscrepancy | None = None
    """Errors of the path of the shoulder's centre; None without an arm."""

    springs: Springs | None = None

    cuffs: Cuffs | None = None

    muscles: MuscleSignals | None = None
    """Measured signals of the wearer's muscles; None without."""

    again: Callable[[], TorqueModel] | None = None
    """Function that returns a second model of the same system, which follows another motion."""

    @property
    def residual_sd(self) -> Joints:
        """Residual of stage 0 [N·m], at least `RESIDUAL_MIN_NM`: no motor is better, and it may not be measured yet."""
        return np.maximum(self.noise.sd, RESIDUAL_MIN_NM)
