"""State of a run: complete, immutable, and restored exactly from its JSON."""

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
    """State of one window, or of one attempt at it."""

    number: int
    attempt: int
    epoch: int
    """Number of program restarts before. Times of different epochs are on different clocks."""

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
    """Deviations of the accepted touches; None in mm without a calibrated screen."""

    def holds(self, t: float) -> bool:
        """Return True if the window was open at `t`. Its last moment does not belong to it."""
        return self.opened <= t and (self.closed is None or t < self.closed)


class RunAlarm(Settings):
    """Alarm for the operator."""

    number: int
    t: float
    text: SentenceText
    is_acknowledged: bool = False


class RunState(Settings):
    """State of a run. Times are on the clock of its events."""

    status: Status = "ready"
    t: float = 0.0
    """Latest time that the run has received [s]."""

    protocol_sha256: str = ""
    """Hash of the protocol of the run."""

    epoch: int = 0
    origin: float = 0.0
    """Time at which the schedule's clock shows 0, while the schedule counts [s]."""

    approach: float = 0.0
    """Time from which the schedule counts [s]."""

    phase: int = -1
    """Index of the last phase that has started, from 0."""

    left_at: float = 0.0
    left_level: float = 1.0
    """Gravity level of the machine when the schedule was left [-]. From there the level goes to 1."""

    wanted: int | None = None
    """Window that the operator has requested; None without a request. Only used if the schedule does not open the
    windows."""

    windows: tuple[WindowState, ...] = ()
    pace: Pace | None = None
    """Pace that was shown last; None before the first."""

    seen: dict[str, tuple[tuple[int, int], ...]] = Field(default={})
    """Received touches by page, as ranges of sequence numbers."""

    touches: int = 0
    rejected: dict[RejectionReason, int] = Field(default={})
    is_feed_lost: bool = False
    alarms: tuple[RunAlarm, ...] = ()

    @property
    def window(self) -> WindowState | None:
        """Window that is open; None if there is none."""
        return self.windows[-1] if self.windows and self.windows[-1].closed is None else None

    @property
    def complete(self) -> frozenset[int]:
        """Numbers of the windows that were run to their end."""
        return frozenset(window.number for window in self.windows if window.is_complete)

    def attempts(self, number: int) -> int:
        """Return the number of attempts at this window so far."""
        return sum(window.number == number for window in self.windows)

    def next_window(self, numbers: range) -> int | None:
        """Return the first incomplete window from the latest one on; else the first incomplete one of all."""
        missing = [number for number in numbers if number not in self.complete]
        latest = self.windows[-1].number if self.windows else numbers[0]
        return next((number for number in missing if number >= latest), missing[0] if missing else None)

    def window_at(self, t: float) -> int | None:
        """Index in `windows` of the window that was open at `t`."""
        for index in range(len(self.windows) - 1, -1, -1):
            if self.windows[index].epoch == self.epoch and self.windows[index].holds(t):
                return index
        return None

    def with_window(self, index: int, **changes: object) -> "RunState":
        """Return the state with one window changed."""
        windows = list(self.windows)
        windows[index] = windows[index].model_copy(update=changes)
        return self.model_copy(update={"windows": tuple(windows)})

    def has_seen(self, touch: Touch) -> bool:
        """Return True if this touch was received before."""
        return any(low <= touch.sequence <= high for low, high in self.seen.get(touch.page, ()))

    def seeing(self, touch: Touch) -> "RunState":
        """Return the state with this touch as received."""
        runs = joined_runs((*self.seen.get(touch.page, ()), (touch.sequence, touch.sequence)))
        return self.model_copy(update={"seen": {**self.seen, touch.page: runs}})


def joined_runs(runs: tuple[tuple[int, int], ...]) -> tuple[tuple[int, int], ...]:
    """Ranges of whole numbers, sorted, with adjacent ranges joined."""
    joined = list[tuple[int, int]]()
    for low, high in sorted(runs):
        if joined and low <= joined[-1][1] + 1:
            joined[-1] = (joined[-1][0], max(high, joined[-1][1]))
        else:
            joined.append((low, high))
    return tuple(joined)
