"""Windows opened and closed by the measured g: hysteresis, dwell, and time-out of the feed."""

from dataclasses import dataclass, replace

from .aircraft_line import AircraftSample, newer_by_ms
from .events import CloseWindow, FeedBack, FeedLost, OpenWindow
from .task_settings import AircraftSettings

RESTARTED_AFTER = 20
"""Number of consecutive older samples with rising times that mean a reset of the sender's clock (two seconds)."""

GAP_MS = 500
"""Longest gap between two samples that does not restart the dwell [ms].

The dwell is the time for which g must keep the new level before a window opens or closes.
"""

AircraftEvent = OpenWindow | CloseWindow | FeedLost | FeedBack


@dataclass(frozen=True)
class AircraftWatch:
    """State of the observed aircraft; immutable. Times without a unit in their name are on the server's clock [s]."""

    settings: AircraftSettings
    level: float
    """Gravity level of the windows in this flight [-]."""

    last: AircraftSample | None = None
    heard: float | None = None
    """Time at which the last new sample arrived [s]; None before the first."""

    is_window: bool = False
    """True if g is that of a window, after hysteresis and dwell."""

    since_ms: int | None = None
    since: float = 0.0
    """Time at which the dwell for the opposite state began [s]: `since_ms` on the aircraft's clock, `since` on the
    server's."""

    is_lost: bool = False
    older_in_row: int = 0
    old_ms: int | None = None
    """Aircraft time of the last sample that was not newer."""

    refused: int = 0
    """Number of duplicated or overtaken samples."""

    def with_sample(self, sample: AircraftSample, t: float) -> tuple["AircraftWatch", tuple[AircraftEvent, ...]]:
        """Return the watch and the events after a sample that arrived at `t`."""
        watch, before = self.at(t)
        gap_ms = None if watch.last is None else newer_by_ms(sample.since_midnight_ms, watch.last.since_midnight_ms)
        if gap_ms is not None and gap_ms <= 0:
            watch = watch._with_older(sample)
            if watch.older_in_row < RESTARTED_AFTER:
                return watch, before
            gap_ms = None
        events: tuple[AircraftEvent, ...] = before
        if watch.is_lost:
            events = (*events, FeedBack(t=t))
        fresh = {"last": sample, "heard": t, "is_lost": False, "older_in_row": 0, "old_ms": None}
        if gap_ms is None or gap_ms > GAP_MS:
            fresh["since_ms"] = None
        watch, more = replace(watch, **fresh)._judged(sample, t)
        return watch, (*events, *more)

    def at(self, t: float) -> tuple["AircraftWatch", tuple[AircraftEvent, ...]]:
        """Return the watch and the events at `t` without a new sample. The feed counts as lost after `silent_s`."""
        if self.heard is None or self.is_lost or t - self.heard < self.settings.silent_s:
            return self, ()
        lost = FeedLost(t=self.heard + self.settings.silent_s)
        return replace(self, is_lost=True, since_ms=None), (lost,)

    def _with_older(self, sample: AircraftSample) -> "AircraftWatch":
        """Return the watch after a duplicated or overtaken sample.

        Many of them with rising times mean a reset clock.
        """
        ms = sample.since_midnight_ms
        rises = self.old_ms is None or newer_by_ms(ms, self.old_ms) > 0
        is_double = self.last is not None and ms == self.last.since_midnight_ms
        row = self.older_in_row if is_double else (self.older_in_row + 1 if rises else 1)
        return replace(self, refused=self.refused + 1, older_in_row=row, old_ms=self.old_ms if is_double else ms)

    def _judged(self, sample: AircraftSample, t: float) -> tuple["AircraftWatch", tuple[AircraftEvent, ...]]:
        off = abs(sample.norm_g - self.level)
        says_otherwise = off > self.settings.close_beyond_g if self.is_window else off < self.settings.open_within_g
        if not says_otherwise:
            return replace(self, since_ms=None), ()
        ms = sample.since_midnight_ms
        if self.since_ms is None:
            return replace(self, since_ms=ms, since=t), ()
        if newer_by_ms(ms, self.since_ms) < 1e3 * self.settings.dwell_s:
            return self, ()
        turned = replace(self, is_window=not self.is_window, since_ms=None)
        if self.is_window:
            return turned, (CloseWindow(t=t, by="aircraft"),)
        return turned, (
            OpenWindow(
                t=t, by="aircraft", since=self.since, parabola=sample.parabola, confirmed=self._confirmed(sample)
            ),
        )

    def _confirmed(self, sample: AircraftSample) -> bool | None:
        """Return True if the announcement agrees with g; None if its meaning is unknown. No decision depends on it."""
        meaning = self.settings.announcements.get(sample.announcement)
        return None if meaning in (None, "other") else meaning == "window"
