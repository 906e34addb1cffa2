"""Data for the picture of `exograv rig check`: a machine and the arm in it, as points in the base frame."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

Points = Float[np.ndarray, "_ 3"]
"""Points in the base frame [m]."""


@dataclass(frozen=True)
class TorqueRow:
    """Torque at rest in the posture that loads the joint most [N·m]."""

    joint: str
    limit: float | None
    """Torque limit of the drive; None without a motor."""
    exo: float
    arm: float
    hand_1kg: float
    friction: float


@dataclass(frozen=True)
class DrawnArm:
    """Arm, and the part of the machine that moves it."""

    side: str
    exo: Points
    links: Float[np.ndarray, "_ 4"]
    """Centre of mass [m] and mass [kg] of each link."""
    arm: Points
    cuffs: Points
    reach: Points
    """Centres of the voxels that the finger tip reaches; `task` holds those in the task workspace."""
    task: Points


@dataclass(frozen=True)
class MachinePicture:
    """Content of the picture of a machine and the arm in it."""

    title: str
    arms: Sequence[DrawnArm]
    rank: int | None
    human_dof: int | None
    largest_arm_kg: float | None
    wearer_arm_kg: float | None
    torque_Nm: Sequence[TorqueRow]
    voxel_m: float
