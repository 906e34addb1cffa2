"""Figures of a verification, as they are written."""

from dataclasses import dataclass, field, replace

import numpy as np

from exograv.options import WorldName
from exograv.recording.rounding import rounded
from exograv.results import MERGED, OPTIONAL, json_value

from .change import ArmChange, StoredVerification, changed_since, stored_verification
from .verification import VerificationResult


@dataclass(frozen=True)
class PostureFigures:
    """Left over at one posture, by joint."""

    deg: list[float]
    left_over_Nm: list[float]
    sd_Nm: list[float]
    beyond_Nm: list[float]
    """Measured torque minus the torque of the model [N·m]."""
    beyond_sd_Nm: list[float]


@dataclass(frozen=True)
class VerificationFigures:
    """Left over, as RMS over all postures."""

    joints: tuple[str, ...]
    left_over_Nm: list[float]
    ci95: list[list[float]]
    target_Nm: list[float]
    fingertip_mm: float
    fingertip_ci95_mm: list[float]
    postures: list[PostureFigures]
    relaxed: bool
    noise_scale: float
    rejected_share: float
    why: str
    motion_s: float


@dataclass(frozen=True)
class VerifiedIdentification:
    """Identification that was verified."""

    motion_s: float
    outcome: str


@dataclass(frozen=True)
class VerifyResult:
    """Result of `exograv arm verify`."""

    rig: str
    disturbance_level: int | None
    world: WorldName | None
    seed: int
    at_utc: str
    found: VerificationFigures = field(metadata=MERGED)
    identification: VerifiedIdentification
    self_test: str
    truth_Nm: list[float] | None
    """True left over of a simulated machine and person, RMS per joint [N·m]; None for a real machine."""
    live: object | None = field(default=None, metadata=OPTIONAL)
    """Figures of the live run on drives."""
    before: ArmChange | None = field(default=None, metadata=OPTIONAL)
    simulated_s: float | None = field(default=None, metadata=OPTIONAL)
    wall_s: float | None = field(default=None, metadata=OPTIONAL)


def compared(result: VerifyResult, former: StoredVerification | None) -> VerifyResult:
    """Return the result with the change since an earlier verification, if there is one.

    Raises:
        ConfigError: The two results are at different postures.
    """
    if former is None:
        return result
    now = stored_verification(json_value(result))
    return replace(result, before=changed_since(former, now, result.found.joints))


def verified_figures(verified: VerificationResult, joints: tuple[str, ...]) -> VerificationFigures:
    """Figures of a verification result."""
    median, low, high = verified.rms
    return VerificationFigures(
        joints=joints,
        left_over_Nm=rounded(median),
        ci95=[rounded(np.array(ends)) for ends in zip(low, high, strict=True)],
        target_Nm=rounded(verified.targets),
        fingertip_mm=round(float(verified.fingertip_mm[0]), 2),
        fingertip_ci95_mm=[round(float(end), 2) for end in verified.fingertip_mm[1:]],
        postures=_postures(verified),
        relaxed=verified.is_relaxed,
        noise_scale=round(verified.left_over.noise_scale, 3),
        rejected_share=round(verified.left_over.rejected_share, 4),
        why=verified.why(joints),
        motion_s=round(verified.motion_s, 1),
    )


def _postures(verified: VerificationResult) -> list[PostureFigures]:
    found, postures = verified.left_over, np.rad2deg(verified.postures)
    columns = postures, found.draws.mean(axis=0), found.draws.std(axis=0), found.beyond, found.beyond_sd
    return [PostureFigures(*(rounded(column[k]) for column in columns)) for k in range(len(postures))]
