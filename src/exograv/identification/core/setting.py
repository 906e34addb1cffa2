"""What every identification method starts from: the same model, the same belief, the same noise."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float

from .discrepancy import Discrepancy
from .interface import Covariance, Joints, Parameters, TorqueModel
from .noise import Noise

RESIDUAL_MIN_NM = 0.01


@dataclass(frozen=True)
class Springs:
    """Where the elasticity of the wearer's joints stands, for a method with another law than a linear one."""

    stiffness: slice
    """Of each freedom [N·m/rad]."""

    offset: slice
    """Stiffness times neutral angle [N·m]."""

    angles: Callable[[], Float[np.ndarray, " freedom"]]
    """The freedoms' angles in the sample that the model linearised last [rad]."""


@dataclass(frozen=True)
class Setting:
    """One arm in one machine, or one payload on one robot, before anything has moved."""

    model: TorqueModel

    mean: Parameters
    """Prior mean, where every method starts."""

    covariance: Covariance
    """Prior covariance; what has none is known."""

    noise: Noise

    bodies: tuple[slice, ...]
    """Inertial parameters of the bodies that are learned."""

    learned: Bool[np.ndarray, " parameter"]
    """What a method without a covariance to hold the rest by may move. Of a robot with a payload, only the payload:
    nothing else would tell such a method how little the robot may still differ from its unloaded log."""

    machine: Bool[np.ndarray, " parameter"]
    """What stage 0 has identified before; a method in stages leaves it."""

    discrepancy: Discrepancy | None = None

    springs: Springs | None = None

    again: Callable[[], TorqueModel] | None = None
    """Another model of the same, which follows a motion of its own."""

    @property
    def residual_sd(self) -> Joints:
        """Stage 0's residual [N·m]; of a machine that was never measured, what no motor is better than."""
        return np.maximum(self.noise.sd, RESIDUAL_MIN_NM)
