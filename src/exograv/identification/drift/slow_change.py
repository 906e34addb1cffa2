"""Slow change of a worn machine that a check has found. The module needs no engine: pages state it in words."""

import enum
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from exograv.identification.core.interface import RESTLESS

Joints = Float[np.ndarray, " joint"]


class Kind(enum.Enum):
    """Kind of a slow change."""

    CUFF = "cuff"
    """A cuff has moved along the limb [m]."""

    SHOULDER = "shoulder"
    """The wearer's shoulder has moved in the machine: three axes of the base [m]."""

    WARM_UP = "warm_up"
    """Friction of all drives has changed by the same share [-]."""

    FRICTION = "friction"
    """Coulomb and viscous friction of a drive have changed by the same share [-]."""

    CONSTANT = "constant"
    """Torque per current of a drive has changed [-]: positive where the motor gives less than its current says."""

    TONE = "tone"
    """The relaxed wearer gives a constant torque about a freedom of the arm [N·m]."""


@dataclass(frozen=True)
class Cause:
    """Slow change that a check considers, such as a cuff that slides."""

    kind: Kind
    place: str
    """Name of the cuff, the joint or the freedom."""
    columns: tuple[int, ...]
    """Columns of the effects that belong to this change."""


@dataclass(frozen=True)
class FoundChange:
    """Change that the check has found, or one of several that it cannot tell apart."""

    cause: Cause
    size: float
    """Most likely size, in the unit of its `Kind`; of a shoulder the distance."""
    half_width: float
    """Half width of the 95 % interval of the size."""
    probability: float
    """Posterior probability that this change has happened [-]."""
    torque_Nm: Joints
    """Torque of the change, RMS over the motion (joint,) [N·m]."""


@dataclass(frozen=True)
class SlowJudgement:
    """Result of one check."""

    changes: tuple[FoundChange, ...]
    """Changes that have surely happened, each beside or without the others."""
    one_of: tuple[FoundChange, ...]
    """Changes of which at least one has happened, and which the motion cannot tell apart; empty if it can."""
    noise_scale: float
    """Size of the wearer's slow torque over the assumed size [-]."""

    @property
    def is_restless(self) -> bool:
        """True if the wearer did not relax. Such a check tells nothing."""
        return self.noise_scale > RESTLESS

    @property
    def is_silent(self) -> bool:
        """True if there is nothing to tell."""
        return self.is_restless or not (self.changes or self.one_of)
