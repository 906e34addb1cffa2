"""Schema of a protocol's TOML file, checked on load."""

from itertools import pairwise
from typing import Annotated, Any, Literal

from pydantic import AfterValidator, Field, PositiveInt, model_validator

from exograv.model.rig_settings import Settings

from .levels import EARTH, LEVELS, RATE_MAX_PER_S, LevelName, slewing_s
from .published_values import refuse_unmarked
from .task_settings import AircraftSettings, PaceSettings, PointingSettings, TargetSettings

ExoMode = Literal["active", "passive", "sham"]
"""Mode of the machine. `active` carries the arm. `passive` only records. `sham` acts as passive, and the people at the

    machine are not told so.
"""
Opening = Literal["clock", "aircraft", "hand"]
Seconds = Annotated[float, Field(ge=0.0, le=86_400.0)]
Duration = Annotated[float, Field(gt=0.0, le=3600.0)]
Level = Annotated[float, Field(ge=0.0, le=2.0)] | LevelName


def level_value(level: float | LevelName) -> float:
    """Return the felt share of Earth weight [-], from a number or a name."""
    return LEVELS[level] if isinstance(level, str) else level


class LevelFrom(Settings):
    """Gravity level of the windows from one number on, until the next entry."""

    window: Annotated[int, Field(ge=0)]
    """Number of the first window with this level."""

    level: Level
    end_level: Level | None = None
    """Level at the end, if the level changes linearly during the window. Absent: constant level."""

    @property
    def start(self) -> float:
        """Level when a window opens [-]."""
        return level_value(self.level)

    @property
    def end(self) -> float:
        """Gravity level at the close of a window [-]."""
        return self.start if self.end_level is None else level_value(self.end_level)


class Windows(Settings):
    """Number, duration and levels of the windows, in which the participant moves."""

    count: Annotated[int, Field(ge=1, le=500)]
    duration_s: Duration
    touches: Annotated[int, Field(ge=1, le=100)]
    """Number of touches that the participant is asked for in a window."""

    first_number: Literal[0, 1] = 1
    levels: Annotated[list[LevelFrom], Field(min_length=1)]

    @property
    def numbers(self) -> range:
        """Numbers of all windows."""
        return range(self.first_number, self.first_number + self.count)

    @property
    def interval_s(self) -> float:
        """Intended time from one touch to the next [s]."""
        return self.duration_s / self.touches

    def level_of(self, window: int) -> LevelFrom:
        """Gravity level in this window."""
        return [entry for entry in self.levels if entry.window <= window][-1]

    @model_validator(mode="after")
    def _levels_in_order(self) -> "Windows":
        starts = [entry.window for entry in self.levels]
        if starts[0] != self.first_number:
            raise ValueError(
                f"levels begin with window {starts[0]}; they must begin with the first window, {self.numbers[0]}"
            )
        if any(later <= earlier for earlier, later in pairwise(starts)) or starts[-1] not in self.numbers:
            raise ValueError(f"levels are of windows {starts}; allowed: rising numbers, at most {self.numbers[-1]}")
        return self


class LongerRest(Settings):
    """Longer rest after one window, as an exception."""

    after_window: Annotated[int, Field(ge=0)]
    rest_s: Duration


class RestTable(Settings):
    """Length of every rest between two windows: one length with exceptions, or a list."""

    rest_s: Duration | None = None
    longer: tuple[LongerRest, ...] = ()
    each_s: Annotated[list[Duration], Field(min_length=1)] | None = None

    @model_validator(mode="after")
    def _one_way(self) -> "RestTable":
        if (self.rest_s is None) == (self.each_s is None) or (self.each_s is not None and self.longer):
            raise ValueError("give rest_s, with longer for exceptions, or each_s with one entry per rest")
        after = [entry.after_window for entry in self.longer]
        if len(set(after)) < len(after):
            raise ValueError(f"longer has two rests after the same window: {after}")
        return self

    def explicit(self, numbers: range) -> tuple[float, ...]:
        """Rest after each window but the last [s].

        Raises:
            ValueError: The table does not fit these windows.
        """
        if self.each_s is not None:
            if len(self.each_s) != len(numbers) - 1:
                raise ValueError(f"each_s has {len(self.each_s)} rests; {len(numbers)} windows need {len(numbers) - 1}")
            return tuple(self.each_s)
        longer = {entry.after_window: entry.rest_s for entry in self.longer}
        if unknown := sorted(set(longer) - set(numbers[:-1])):
            raise ValueError(f"longer names window {unknown[0]}; a rest comes after {numbers[0]} to {numbers[-1] - 1}")
        return tuple(longer.get(number, self.rest_s or 0.0) for number in numbers[:-1])


class Ramps(Settings):
    """Change of the machine's level between rest and window."""

    duration_s: Duration = 5.0
    hold_s: Annotated[float, Field(ge=0.0, le=60.0)] = 2.0
    """Time from the end of the ramp to the opening of the window."""


class Hypergravity(Settings):
    """Pull-up of an aircraft before and after each window. An active machine makes it on the ground.

    The machine's ramps may take longer than the aircraft's; they then begin earlier, and the pull-up is shorter.
    """

    level: Level
    duration_s: Duration
    ramp_s: Duration
    """Duration of the ramp into hypergravity, and of the ramp out of it."""


def _name(text: str) -> str:
    if not text or not text.replace("_", "").replace("-", "").isalnum() or len(text) > 40:
        raise ValueError("a name has up to 40 letters, digits, '-' and '_'")
    return text


class Protocol(Settings):
    """Content of a protocol file, which describes one kind of session, such as a training."""

    schema_version: Literal[1]
    name: Annotated[str, AfterValidator(_name)]
    title: Annotated[str, Field(min_length=1, max_length=200)]
    kind: Literal["training", "familiarisation", "flight"]
    """Kind of session, as in the paper. Values that differ from that kind in the paper must be in `unpublished`."""

    sessions: PositiveInt
    """Number of sessions of one person."""

    exo: Literal["active", "passive"]
    opening: Opening
    windows: Windows
    before_first_s: Duration
    after_last_s: Duration
    rests: str
    """Name of the rest table in use."""

    rest_tables: Annotated[dict[str, RestTable], Field(min_length=1)]
    ramps: Ramps = Ramps()
    hypergravity: Hypergravity | None = None
    pace: PaceSettings
    target: TargetSettings
    pointing: PointingSettings
    aircraft: AircraftSettings = AircraftSettings()
    unpublished: tuple[str, ...] = ()
    """Fields, or tables, with values that we chose. All other values are from the paper."""

    @model_validator(mode="after")
    def _fits_together(self) -> "Protocol":
        if self.rests not in self.rest_tables:
            raise ValueError(f"rests is '{self.rests}'; tables in the file: {', '.join(self.rest_tables)}")
        for name, table in self.rest_tables.items():
            self._refuse_short_rests(name, table.explicit(self.windows.numbers))
        if self.pace.tolerance_s >= self.windows.interval_s:
            raise ValueError(
                f"pace.tolerance_s {self.pace.tolerance_s:g} must be below {self.windows.interval_s:g}, from touch to "
                "touch"
            )
        self._refuse_levels()
        refuse_unmarked(self.kind, self.leaves, self.unpublished)
        return self

    def _refuse_short_rests(self, name: str, rests: tuple[float, ...]) -> None:
        needed = {"active": 2.0 * self.ramps.duration_s + self.ramps.hold_s, "passive": 0.0}[self.exo]
        if self.hypergravity is not None:
            needed = max(needed, 2.0 * (self.hypergravity.duration_s + 2.0 * self.hypergravity.ramp_s))
        if rests and min(rests) < needed:
            raise ValueError(f"rest_tables.{name}: a rest of {min(rests):g} s is too short for {needed:g} s of ramps")
        if min(self.before_first_s, self.after_last_s) < 0.5 * needed:
            raise ValueError(f"before_first_s and after_last_s need {0.5 * needed:g} s or more, for the ramps")

    def _refuse_levels(self) -> None:
        if self.exo == "active" and self.opening != "clock":
            raise ValueError(
                "exo 'active' needs opening 'clock': the level must have changed before a window opens, and only "
                "with a clock the time of opening is known in advance"
            )
        for entry in self.windows.levels:
            if self.exo == "active" and self.hypergravity is not None:
                self._refuse_short_pull_up(self.hypergravity, entry)
            if self.exo == "active":
                fastest = max(
                    abs(EARTH - entry.start) / self.ramps.duration_s,
                    abs(EARTH - entry.end) / self.ramps.duration_s,
                    abs(entry.end - entry.start) / self.windows.duration_s,
                )
                if fastest > RATE_MAX_PER_S + 1e-9:
                    raise ValueError(
                        f"the level of window {entry.window} changes by {fastest:.2f} per second; allowed: "
                        f"at most {RATE_MAX_PER_S:g}. Make ramps.duration_s longer"
                    )
            if self.opening == "aircraft" and abs(entry.start - EARTH) <= 2.0 * self.aircraft.close_beyond_g:
                raise ValueError(f"windows at {entry.start:g} g are like level flight; use opening 'hand'")

    def _refuse_short_pull_up(self, hyper: Hypergravity, entry: LevelFrom) -> None:
        high, lasts_s = level_value(hyper.level), hyper.duration_s + 2.0 * hyper.ramp_s
        for level in (entry.start, entry.end):
            ramps = slewing_s(EARTH, high) + slewing_s(high, level)
            if ramps > lasts_s:
                raise ValueError(
                    f"[hypergravity] lasts {lasts_s:g} s with its ramps; the machine's ramps between {EARTH:g}, "
                    f"{high:g} and the level of window {entry.window} take {ramps:g} s"
                )

    @property
    def rest_lengths_s(self) -> tuple[float, ...]:
        """Rest after each window but the last, from the table in use [s]."""
        return self.rest_tables[self.rests].explicit(self.windows.numbers)

    @property
    def leaves(self) -> dict[str, Any]:
        """All chosen values by their path in the file."""
        free = {"schema_version", "name", "title", "kind", "unpublished"}
        return dict(_leaves(self.model_dump(mode="json", exclude=free), ""))


def _leaves(value: Any, path: str) -> list[tuple[str, Any]]:
    if not isinstance(value, dict) or not value:
        return [(path, value)]
    return [leaf for key, inner in value.items() for leaf in _leaves(inner, f"{path}.{key}" if path else key)]
