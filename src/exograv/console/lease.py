"""Who steers: one page at a time, for as long as it shows that somebody has it in view."""

from dataclasses import dataclass

BEAT_EVERY_S = 0.2
"""So often the page that steers says so [s]."""

ALARM_AFTER_S = 1.0
"""So long it may be silent before that is an alarm [s]."""

LEASE_S = 1.2
"""And so long before nothing is taken from it any more [s]. F31."""


@dataclass
class Lease:
    """A single writer. One that was silent for too long has lost it, and must ask again."""

    holder: int | None = None
    """Number of its line."""

    _beaten: float = -1e9

    def ask(self, line: int, t: float) -> bool:
        """Whether this line has it now; nobody takes it from another that lives."""
        if self.held_by(t) not in (None, line):
            return False
        self.holder, self._beaten = line, t
        return True

    def beat(self, line: int, t: float) -> bool:
        """The holder lives; False where the line does not hold it (any more)."""
        if self.held_by(t) != line:
            return False
        self._beaten = t
        return True

    def held_by(self, t: float) -> int | None:
        """Who steers at `t`; a lease that ran out stays lost."""
        if self.holder is not None and t - self._beaten > LEASE_S:
            self.holder = None
        return self.holder

    def silent_s(self, t: float) -> float:
        """Since the holder's last word; 0 where nobody holds it [s]."""
        return 0.0 if self.holder is None else t - self._beaten

    def give_up(self, line: int) -> None:
        """Its line is closed."""
        if self.holder == line:
            self.holder = None
