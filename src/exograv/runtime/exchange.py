"""What guard and control tell each other in a tick of the live loop, and what of it is recorded."""

import numpy as np

RESET, STOP_PRESSED, ASTRAY = 1, 2, 4
"""Bits of `acts` in a recorded tick, in the order in which they come between two ticks."""

UNANSWERED = ("v", "tau_feedforward", "tau_desired", "closure_slope", "drive", "gravity_level", "arm_share")
"""Of a recorded tick: unknown to the guard where control did not answer in time."""


def state_dtype(joints: int) -> np.dtype:
    """What the guard tells control in a tick."""
    per_joint = (joints,)
    return np.dtype(
        [
            ("sequence", "<i8"),
            ("now", "<f8"),
            ("safe_state", "<i8"),
            ("q", "<f8", per_joint),
            ("current", "<f8", per_joint),
        ],
        align=True,
    )


def answer_dtype(joints: int) -> np.dtype:
    """What control answers."""
    per_joint = (joints,)
    return np.dtype(
        [
            ("sequence", "<i8"),
            ("valid_until", "<f8"),
            ("mode", "<i8"),
            ("slope", "<f8"),
            ("drive", "<f8"),
            ("gravity_level", "<f8"),
            ("arm_share", "<f8"),
            ("seen", "<u8"),
            ("v", "<f8", per_joint),
            ("tau", "<f8", per_joint),
            ("tau_feedforward", "<f8", per_joint),
        ],
        align=True,
    )


def answered_to(seen: int, passed: int) -> int:
    """Bit k: whether the measurement k before the newest was answered to; `passed` is how many are new."""
    return 1 if passed > 63 else (seen << passed | 1) & 0xFFFFFFFFFFFFFFFF
