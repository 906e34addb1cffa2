"""Lease of the steering page: one page at a time, renewed by heartbeats while the page is in view."""

from dataclasses import dataclass

BEAT_EVERY_S = 0.2
"""Period of the heartbeat of the steering page [s]."""

ALARM_AFTER_S = 1.0
"""Silence of the steering page that raises an alarm [s]."""

LEASE_S = 1.2
"""Silence after which the page loses the lease [s]. Hazard F31."""


@dataclass
class Lease:
    """Right of a single page to steer. A page that was silent for too long loses it, and must ask again."""

    holder: int | None = None
    """Number of the line that holds the lease; None without a holder."""

    expired: int | None = None
    """Number of the line whose page lost the lease because it was silent; None otherwise. The broadcaster reads and
    clears it."""

    is_hidden: bool = False
    """True if the last heartbeat said that the page was in the background."""

    _beaten: float = -1e9

    def ask(self, line: int, t: float) -> bool:
        """Ask for the lease; return True if this line has it now. A live holder keeps the lease."""
        if self.held_by(t) not in (None, line):
            return False
        self.holder, self._beaten, self.is_hidden = line, t, False
        return True

    def beat(self, line: int, t: float, is_hidden: bool = False) -> bool:
        """Renew the lease; return False if the line no longer holds it."""
        if self.held_by(t) != line:
            return False
        self._beaten, self.is_hidden = t, is_hidden
        return True

    def held_by(self, t: float) -> int | None:
        """Return the holder at `t` [s]. An expired lease stays lost."""
        if self.holder is not None and t - self._beaten > LEASE_S:
            self.expired, self.holder = self.holder, None
        return self.holder

    def silent_s(self, t: float) -> float:
        """Time since the last heartbeat of the holder [s]; 0 without a holder."""
        return 0.0 if self.holder is None else t - self._beaten

    def give_up(self, line: int) -> None:
        """Release the lease of a closed line."""
        if self.holder == line:
            self.holder = None
