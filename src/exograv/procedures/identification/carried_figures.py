"""Figures of the decision to float: the part of the estimate that the machine carries, for JSON and pages."""

from dataclasses import dataclass

import numpy as np

from exograv.identification.core.carried_arm import CarriedArm
from exograv.recording.rounding import rounded


@dataclass(frozen=True)
class CarriedFigures:
    """Decision per joint; the sentences are in `why` of the identification. Bounds are None without uncertainty."""

    is_whole: bool
    """True if the estimate is carried in full on every axis."""
    share: list[float]
    """Share of the change of torque that is carried [-]."""
    change_Nm: list[float]
    """Change of torque from the table to the estimate, RMS over the task workspace."""
    bound_Nm: list[float] | None
    """95 % bound of the estimate's error along the change."""
    stated_Nm: list[float] | None
    """Left over that the estimate states for itself."""
    table_Nm: list[float] | None
    """Left over that the prior states for the table."""

    @classmethod
    def of(cls, carried: CarriedArm) -> "CarriedFigures":
        """Round the figures of one decision."""
        bounds = carried.bound_Nm, carried.stated_Nm, carried.table_Nm
        return cls(
            carried.is_whole,
            rounded(carried.share),
            rounded(carried.change_Nm),
            *(None if np.isnan(bound).any() else rounded(bound) for bound in bounds),
        )
