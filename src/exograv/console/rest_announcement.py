"""Announcement on the participant's page that the machine moves the arm in a rest."""

import math
from typing import Any

from exograv.experiment.steered.view_models import SessionSnapshot

OVER_S = 10.0
"""Time for which the page says that the motion is over [s]."""


class RestAnnouncement:
    """Announcement in force: before the motion, during it, while the arm is held, and after it."""

    def __init__(self) -> None:
        """Begin without a rest."""
        self._was_active, self._over_until_s = False, -math.inf

    def look(self, shown: SessionSnapshot, t: float) -> dict[str, Any] | None:
        """Return the announcement at time `t` [s] for the page; None without one.

        After a motion that ended early, as by Stop, the mode of the machine is the news: the page no longer announces.
        """
        rests = shown.rests
        is_active = rests is not None and rests.is_active
        if self._was_active and not is_active:
            self._over_until_s = t + OVER_S
        self._was_active = is_active
        if rests is None or (is_active and rests.stage is None):
            return None
        if is_active:
            return {"stage": rests.stage, "seconds": round(rests.moves_s)}
        is_over = t < self._over_until_s and shown.mode == "floating"
        return {"stage": "over", "seconds": round(rests.moves_s)} if is_over else None
