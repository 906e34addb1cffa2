"""Comparison of two verifications of the same arm: the change, and if it is larger than chance explains."""

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Bool, Float

from exograv.errors import ConfigError

GIVE = "Give a file that `exograv arm verify --json` has written for this machine, with the same --seed."
CHANCE = 0.05
"""Probability of a false change, over all joints together [-]."""

SAME_DEG = 0.01

NEEDED = ("rig", "joints", "at_utc", "left_over_Nm", "postures")


@dataclass(frozen=True)
class StoredVerification:
    """Part of a verification that is compared with another one."""

    at_utc: str
    left_over_Nm: Float[np.ndarray, " joint"]
    deg: Float[np.ndarray, "posture joint"]
    beyond_Nm: Float[np.ndarray, "posture joint"]
    """Measured torque minus the torque of the model, at each posture [N·m]."""
    beyond_sd_Nm: Float[np.ndarray, "posture joint"]


@dataclass(frozen=True)
class ArmChange:
    """Change of the left over since an earlier verification, by joint."""

    at_utc: str
    """Time of the earlier verification (UTC)."""
    minutes: float
    left_over_change_Nm: list[float]
    chance: list[float]
    """Probability of a change of this size by chance alone."""
    more_than_chance: list[bool]
    why: str


def read_former(path: Path, rig: str) -> StoredVerification:
    """Read an earlier result, before anything moves.

    Raises:
        ConfigError: The file cannot be read, or is not a result of this machine.
    """
    try:
        former = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        raise ConfigError(f"--before {path} cannot be read: {error}. {GIVE}") from error
    missing = [name for name in NEEDED if not isinstance(former, dict) or name not in former]
    if missing:
        raise ConfigError(f"--before {path} has no '{missing[0]}': it is not a result of a verification. {GIVE}")
    if former["rig"] != rig:
        raise ConfigError(f"--before {path} belongs to {former['rig']}, not to {rig}. {GIVE}")
    return stored_verification(former)


def stored_verification(result: Mapping[str, Any]) -> StoredVerification:
    """Read the JSON object of a result.

    Raises:
        ConfigError: A posture lacks a figure.
    """
    columns = (_column(result, name) for name in ("deg", "beyond_Nm", "beyond_sd_Nm"))
    return StoredVerification(result["at_utc"], np.array(result["left_over_Nm"]), *columns)


def changed_since(former: StoredVerification, now: StoredVerification, joints: Sequence[str]) -> ArmChange:
    """Return the change of the motors' torque by joint, and its probability by chance alone.

    The comparison uses the torque beyond the model at each posture. The division of that torque into weight and springs
    is the same in both verifications, so it cancels in the difference.

    Raises:
        ConfigError: The two results are at different postures.
    """
    from scipy.stats import chi2  # takes 0.3 s to import, which no tick may wait for

    if former.deg.shape != now.deg.shape or np.abs(former.deg - now.deg).max() > SAME_DEG:
        raise ConfigError(f"--before is a result at other postures and cannot be compared. {GIVE}")
    difference = now.beyond_Nm - former.beyond_Nm
    sd = np.hypot(now.beyond_sd_Nm, former.beyond_sd_Nm)
    probability = chi2.sf(((difference / sd) ** 2).sum(axis=0), len(difference))
    is_change = probability < CHANCE / len(probability)
    minutes = (datetime.fromisoformat(now.at_utc) - datetime.fromisoformat(former.at_utc)).total_seconds() / 60.0
    by = now.left_over_Nm - former.left_over_Nm
    return ArmChange(
        at_utc=former.at_utc,
        minutes=round(minutes, 1),
        left_over_change_Nm=[round(float(value), 4) for value in by],
        chance=[float(f"{value:.3g}") for value in probability],
        more_than_chance=[bool(value) for value in is_change],
        why=_sentence(joints, is_change, by),
    )


def _column(result: Mapping[str, Any], name: str) -> Float[np.ndarray, "posture joint"]:
    try:
        return np.array([posture[name] for posture in result["postures"]], dtype=float)
    except (KeyError, TypeError, ValueError) as error:
        raise ConfigError(f"--before contains no '{name}' of its postures. {GIVE}") from error


def _sentence(joints: Sequence[str], is_change: Bool[np.ndarray, " joint"], by: Float[np.ndarray, " joint"]) -> str:
    if not is_change.any():
        return "No joint changed by more than chance."
    names = ", ".join(f"{joints[j]} ({by[j]:+.2f} N·m)" for j in np.flatnonzero(is_change).tolist())
    return f"Changed by more than chance: {names}. Check the cuffs, and identify again if a target is missed."
