"""Columns of a recording as they are stored, before they are cut into motions on an even grid of time."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float

from exograv.errors import ConfigError, RecordingError
from exograv.model.description import RigDescription

MASS_MOST_KG = 100.0
"""Largest weight that a recording may state [kg]: a larger number is in grams."""


@dataclass(frozen=True)
class WornMotion:
    """Identification of an arm in a recording."""

    wearer: Mapping[str, Any]
    """Body data of the person, as the recording states them; empty if it does not."""

    period_s: float
    """Time between two ticks [s]."""

    q: Float[np.ndarray, "tick joint"]
    """Measured positions [rad]."""

    current: Float[np.ndarray, "tick joint"]
    """Measured currents [A]."""

    pieces: tuple[tuple[int, int], ...]
    """First tick and tick after the last one of each piece without a gap."""

    @property
    def seconds(self) -> float:
        """Length of all pieces [s]."""
        return self.period_s * sum(end - begin for begin, end in self.pieces)


@dataclass(frozen=True)
class RecordedColumns:
    """Columns of a recording as they are stored, one row per tick."""

    t: Float[np.ndarray, " tick"]
    q: Float[np.ndarray, "tick joint"]
    current: Float[np.ndarray, "tick joint"]
    current_asked: Float[np.ndarray, "tick joint"]
    hung: Float[np.ndarray, "tick hanging"]
    is_simulated: bool = False
    q_motor: Float[np.ndarray, "tick joint"] | None = None
    temperature: Float[np.ndarray, "tick joint"] | None = None
    worn_s: float = 0.0
    worn: WornMotion | None = None
    is_own: bool = True
    """True for a recording of exograv, which has one row for each command."""
    wrench: Float[np.ndarray, "tick 6"] | None = None
    force_frame: str | None = None


def hung_row(description: RigDescription, mount: str, mass_kg: float) -> Float[np.ndarray, " hanging"]:
    """Return a weight at a mount in the form of `Sweeps.hung` [-].

    Raises:
        ConfigError: The machine has no such mount.
    """
    if mount not in description.mounts:
        raise ConfigError(f"No mount '{mount}' in {description.name}. Mounts: {', '.join(description.mounts)}.")
    weights = description.calibration.weights_kg
    row = np.zeros(len(description.mounts) * len(weights))
    row[description.mounts.index(mount) * len(weights)] = mass_kg / weights[0]
    return row


def no_weight(description: RigDescription, ticks: int) -> Float[np.ndarray, "tick hanging"]:
    """Return the absence of all weights in the form of `Sweeps.hung` [-]."""
    return np.zeros((ticks, len(description.mounts) * len(description.calibration.weights_kg)))


def refuse_wrong_mass(path: Path, masses_kg: Float[np.ndarray, " tick"]) -> None:
    """Refuse weights that are negative or cannot be kilograms.

    Raises:
        RecordingError: A mass is not between 0 and `MASS_MOST_KG`.
    """
    low, high = float(np.nanmin(masses_kg)), float(np.nanmax(masses_kg))
    if not 0.0 <= low <= high <= MASS_MOST_KG:
        raise RecordingError(
            f"{path}: the weights are {low:g} to {high:g} kg; allowed: 0 to {MASS_MOST_KG:g} kg. Give kilograms."
        )


def torque_per_current(tau: np.ndarray, current: np.ndarray, nominal: np.ndarray) -> np.ndarray:
    """Torque per current of each joint by the recording itself; the nominal one where there is no current."""
    large = (np.abs(current) > 0.1 * np.nanmax(np.abs(current), axis=0)) & np.isfinite(tau)
    ratio = nominal.copy()
    for joint, rows in enumerate(large.T):
        if rows.any():
            ratio[joint] = np.median(tau[rows, joint] / current[rows, joint])
    return ratio
