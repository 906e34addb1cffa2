"""When measured g opens and closes a window: hysteresis, a dwell, and what to do when nothing comes any more."""

from dataclasses import dataclass, replace

from .aircraft_line import AircraftSample, newer_by_ms
from .events import CloseWindow, FeedBack, FeedLost, OpenWindow
from .task_settings import AircraftSettings

RESTARTED_AFTER = 20
"""Samples in a row that are older than the last, and rise: the sender's clock was set, two seconds ago."""

GAP_MS = 500
"""A dwell is not counted across a longer gap: what was in it nobody knows."""

AircraftEvent = OpenWindow | CloseWindow | FeedLost | FeedBack


@dataclass(frozen=True)
class AircraftWatch:
    """What has been seen of the aircraft; immutable. Times without unit in their name are the server's [s]."""

    settings: AircraftSettings
    level: float
    """Of the windows that are flown [-]."""

    last: AircraftSample | None = None
    heard: float | None = None
    """When the last new sample came."""

    is_window: bool = False
    """Whether g is that of a window, by hysteresis and dwell."""

    since_ms: int | None = None
    since: float = 0.0
    """When g has begun to say otherwise, by both clocks."""

    is_lost: bool = False
    older_in_row: int = 0
    old_ms: int | None = None
    """Of the last sample that was not newer."""

    refused: int = 0
    """Samples that were doubled, or overtaken by newer ones."""

    def with_sample(self, sample: AircraftSample, t: float) -> tuple["AircraftWatch", tuple[AircraftEvent, ...]]:
        """After a sample that came at `t`."""
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
        """At `t`, when nothing has come: the feed is lost after a while."""
        if self.heard is None or self.is_lost or t - self.heard < self.settings.silent_s:
            return self, ()
        lost = FeedLost(t=self.heard + self.settings.silent_s)
        return replace(self, is_lost=True, since_ms=None), (lost,)

    def _with_older(self, sample: AircraftSample) -> "AircraftWatch":
        """Doubled or overtaken; many that rise among themselves come from a clock that was set."""
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
        """Whether the announcement says what g says; nothing depends on it."""
        meaning = self.settings.announcements.get(sample.announcement)
        return None if meaning in (None, "other") else meaning == "window"
