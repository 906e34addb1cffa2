"""Checks of gravity levels requested from outside, before the guard decides, with the reasons of refusal."""

from collections import Counter

from exograv.safety.guard import SafeState

EVERY_S = 1.0
"""Time between two levels that are passed on [s]; each is recorded, and a replay finds it by its time."""


class Levels:
    """Check of the gravity levels that are requested in one run. The guard has the final decision."""

    def __init__(self, accepts: bool):
        """Start without a request.

        Args:
            accepts: True if the run was started with permission for levels from outside.
        """
        self._accepts, self._has_stopped = accepts, False
        self.accepted: list[tuple[float, float]] = []
        """Accepted levels, each with its time on the rig's clock [s]."""
        self.refused = Counter[str]()
        """Number of refusals, by reason."""

    def look(self, safe_state: int) -> None:
        """Update by the guard's present state; a stop refuses all levels for the rest of the run."""
        self._has_stopped |= safe_state >= SafeState.DESCENT

    def ask(self, level: float, now: float) -> str:
        """Return the reason against this level at the time `now` [s] of the rig's clock; empty if it is passed on."""
        why = self._objection(level, now)
        if why:
            self.refused[why] += 1
        else:
            self.accepted.append((now, level))
        return why

    def _objection(self, level: float, now: float) -> str:
        if not self._accepts:
            return "this run takes no gravity level over ROS 2; start it with --ros2-accept-gravity-level"
        if not 0.0 <= level <= 1.0:
            return "allowed are 0 (weightless) to 1 (Earth)"
        if self._has_stopped:
            return "the run was stopped; the operator at the machine decides how it goes on"
        if self.accepted and now - self.accepted[-1][0] < EVERY_S:
            return f"one was taken less than {EVERY_S:g} s ago"
        return ""
