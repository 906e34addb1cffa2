"""Which of the gravity levels that somebody else asks for are passed on to the guard, and why the others are not."""

from collections import Counter

from exograv.safety.guard import SafeState

EVERY_S = 1.0
"""Between two levels that are passed on: each is recorded, and found again by its time in a replay [s]."""


class Levels:
    """Of one run. The guard has the last word, on what has happened meanwhile."""

    def __init__(self, accepts: bool):
        """Nothing has been asked for.

        Args:
            accepts: Whether the run was started to take levels from outside at all.
        """
        self._accepts, self._has_stopped = accepts, False
        self.accepted: list[tuple[float, float]] = []
        """When, on the rig's clock [s], and which."""
        self.refused = Counter[str]()
        """Why, and how often."""

    def look(self, safe_state: int) -> None:
        """What the guard says now; a stop closes this way for the rest of the run."""
        self._has_stopped |= safe_state >= SafeState.DESCENT

    def ask(self, level: float, now: float) -> str:
        """Why this level is not passed on at the time `now` [s] of the rig's clock; empty where it is."""
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
            return "the run was stopped; who is at the machine decides how it goes on"
        if self.accepted and now - self.accepted[-1][0] < EVERY_S:
            return f"one was taken less than {EVERY_S:g} s ago"
        return ""
