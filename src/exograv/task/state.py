"""Where a run is: all of it, immutable, and the same again from its JSON."""

from typing import Literal

from pydantic import Field

from exograv.model.rig_settings import Settings
from exograv.sentence import SentenceText

from .events import Touch
from .pace import Pace
from .pointing import PointingCycle, RejectionReason
from .records import ClosedBy, Mark

Status = Literal["ready", "running", "paused", "stopped", "finished"]


class WindowState(Settings):
    """One window, or one attempt at it."""

    number: int
    attempt: int
    epoch: int
    """Times of another epoch are by another clock."""

    opened: float
    by: Literal["clock", "aircraft", "hand"]
    closed: float | None = None
    closed_by: ClosedBy | None = None
    is_complete: bool = False
    marks: tuple[Mark, ...] = ()
    cycle: PointingCycle = PointingCycle()
    touches: int = 0
    deviations_px: tuple[float, ...] = ()
    deviations_mm: tuple[float | None, ...] = ()
    """Of the accepted touches."""

    def holds(self, t: float) -> bool:
        """Whether it was open then; its last moment does not belong to it."""
        return self.opened <= t and (self.closed is None or t < self.closed)


class RunAlarm(Settings):
    """What the operator has to know."""

    number: int
    t: float
    text: SentenceText
    is_acknowledged: bool = False


class RunState(Settings):
    """Of a run; times are by the clock of its events."""

    status: Status = "ready"
    t: float = 0.0
    """The latest time that it was told."""

    protocol_sha256: str = ""
    """Of the protocol that was begun."""

    epoch: int = 0
    origin: float = 0.0
    """When the schedule's clock shows 0, while it counts."""

    approach: float = 0.0
    """From when on it counts."""

    phase: int = -1
    """The last one that has begun, counted from 0."""

    left_at: float = 0.0
    left_level: float = 1.0
    """Where the machine's level was when the schedule was left; from there it goes to 1."""

    wanted: int | None = None
    """The window that an operator has asked for, where no clock opens it."""

    windows: tuple[WindowState, ...] = ()
    pace: Pace | None = None
    """As last told."""

    seen: dict[str, tuple[tuple[int, int], ...]] = Field(default={})
    """Touches that have come, by page: runs of sequence numbers."""

    touches: int = 0
    rejected: dict[RejectionReason, int] = Field(default={})
    is_feed_lost: bool = False
    alarms: tuple[RunAlarm, ...] = ()

    @property
    def window(self) -> WindowState | None:
        """The open one."""
        return self.windows[-1] if self.windows and self.windows[-1].closed is None else None

    @property
    def complete(self) -> frozenset[int]:
        """Numbers of the windows that were run to their end."""
        return frozenset(window.number for window in self.windows if window.is_complete)

    def attempts(self, number: int) -> int:
        """At this window so far."""
        return sum(window.number == number for window in self.windows)

    def next_window(self, numbers: range) -> int | None:
        """The first from the latest on that is not complete; else any that is missing."""
        missing = [number for number in numbers if number not in self.complete]
        latest = self.windows[-1].number if self.windows else numbers[0]
        return next((number for number in missing if number >= latest), missing[0] if missing else None)

    def window_at(self, t: float) -> int | None:
        """Which of `windows` was open then."""
        for index in range(len(self.windows) - 1, -1, -1):
            if self.windows[index].epoch == self.epoch and self.windows[index].holds(t):
                return index
        return None

    def with_window(self, index: int, **changes: object) -> "RunState":
        """The same with one window changed."""
        windows = list(self.windows)
        windows[index] = windows[index].model_copy(update=changes)
        return self.model_copy(update={"windows": tuple(windows)})

    def has_seen(self, touch: Touch) -> bool:
        """Whether it came before."""
        return any(low <= touch.sequence <= high for low, high in self.seen.get(touch.page, ()))

    def seeing(self, touch: Touch) -> "RunState":
        """The same when it has come."""
        runs = joined_runs((*self.seen.get(touch.page, ()), (touch.sequence, touch.sequence)))
        return self.model_copy(update={"seen": {**self.seen, touch.page: runs}})


def joined_runs(runs: tuple[tuple[int, int], ...]) -> tuple[tuple[int, int], ...]:
    """Runs of whole numbers, sorted, those joined that touch each other."""
    joined = list[tuple[int, int]]()
    for low, high in sorted(runs):
        if joined and low <= joined[-1][1] + 1:
            joined[-1] = (joined[-1][0], max(high, joined[-1][1]))
        else:
            joined.append((low, high))
    return tuple(joined)
