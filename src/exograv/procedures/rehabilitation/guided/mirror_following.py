"""Distance of the following arm from the mirror image of the leading one, with and without its delay."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

LATE_MAX_S = 1.0
"""Largest delay of the following arm in the search for its delay [s]."""


@dataclass(frozen=True)
class Following:
    """Distance of the following arm from the mirror image of the leading one."""

    tracking_rms_deg: np.ndarray
    late_s: float | None
    """Delay at which the distance is smallest; None after too short a session."""
    late_rms_deg: np.ndarray
    """Distance at that delay."""


def followed(at: Float[np.ndarray, "tick both"], dt: float) -> Following:
    """Distance of the following arm from the mirror image, without delay and with the best delay.

    Args:
        at: Posture of the leading arm, mirrored, then that of the following arm [rad].
        dt: Period [s].
    """
    if len(at) < 2.0 * LATE_MAX_S / dt:
        return Following(np.zeros(0), None, np.zeros(0))
    image, own = np.split(np.rad2deg(at), 2, axis=1)

    def rms(late: int) -> Float[np.ndarray, " joint"]:
        return np.sqrt(np.mean((image[: len(image) - late] - own[late:]) ** 2, axis=0))

    lates = range(0, round(LATE_MAX_S / dt), max(round(0.01 / dt), 1))
    best = min(lates, key=lambda late: float((rms(late) ** 2).sum()))
    return Following(rms(0).round(3), round(best * dt, 3), rms(best).round(3))
