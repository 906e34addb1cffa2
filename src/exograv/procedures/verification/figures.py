"""The figures of a verification, as they are written."""

from typing import Any

import numpy as np

from exograv.recording.rounding import rounded

from .verification import VerificationResult


def verified_figures(verified: VerificationResult, joints: tuple[str, ...]) -> dict[str, Any]:
    """What the passes tell."""
    median, low, high = verified.rms
    return {
        "joints": list(joints),
        "left_over_Nm": rounded(median),
        "ci95": [rounded(np.array(ends)) for ends in zip(low, high, strict=True)],
        "target_Nm": rounded(verified.targets),
        "fingertip_mm": round(float(verified.fingertip_mm[0]), 2),
        "fingertip_ci95_mm": [round(float(end), 2) for end in verified.fingertip_mm[1:]],
        "postures": _rows(verified),
        "relaxed": verified.is_relaxed,
        "noise_scale": round(verified.left_over.noise_scale, 3),
        "rejected_share": round(verified.left_over.rejected_share, 4),
        "why": verified.why(joints),
        "motion_s": round(verified.motion_s, 1),
    }


def _rows(verified: VerificationResult) -> list[dict[str, Any]]:
    """One a posture."""
    found = verified.left_over
    columns = {
        "deg": np.rad2deg(verified.postures),
        "left_over_Nm": found.draws.mean(axis=0),
        "sd_Nm": found.draws.std(axis=0),
        "beyond_Nm": found.beyond,
        "beyond_sd_Nm": found.beyond_sd,
    }
    return [{name: rounded(values[k]) for name, values in columns.items()} for k in range(len(verified.postures))]
