"""A protocol laid out in time: phases, windows, and the gravity level at any moment."""

import bisect
import enum
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property

from .levels import EARTH
from .protocol_schema import ExoMode, Protocol, level_value


class PhaseKind(enum.Enum):
    """What a phase is for; the value is the word in records."""

    REST = "rest"
    RAMP = "ramp"
    """The level changes."""

    HOLD = "hold"
    """It has changed, and a window is about to open."""

    WINDOW = "window"
    HYPER = "hyper"
    """Of the aircraft: the level of a pull-up."""


@dataclass(frozen=True)
class Phase:
    """A stretch of the schedule; its level changes along a line."""

    kind: PhaseKind
    start_s: float
    """On the schedule's own clock, which begins with the first rest [s]."""

    duration_s: float
    level_from: float
    level_to: float
    """Felt share of Earth weight, as the protocol states it [-]."""

    window: int
    """The window itself, or the one that comes next; after the last one, the last."""

    @property
    def end_s(self) -> float:
        """When the next one begins [s]."""
        return self.start_s + self.duration_s

    def level_at(self, s: float) -> float:
        """Of a time in the phase [-]."""
        share = (s - self.start_s) / self.duration_s if self.duration_s > 0.0 else 1.0
        return self.level_from + min(max(share, 0.0), 1.0) * (self.level_to - self.level_from)


@dataclass(frozen=True)
class Timeline:
    """All phases one after the other, without gap."""

    protocol: Protocol
    phases: tuple[Phase, ...]

    @property
    def duration_s(self) -> float:
        """From the first rest to the end of the last [s]."""
        return self.phases[-1].end_s

    @cached_property
    def windows(self) -> dict[int, Phase]:
        """The windows by their number."""
        return {phase.window: phase for phase in self.phases if phase.kind is PhaseKind.WINDOW}

    @cached_property
    def starts_s(self) -> tuple[float, ...]:
        """Of all phases [s]."""
        return tuple(phase.start_s for phase in self.phases)

    def phase_at(self, s: float) -> Phase:
        """Which phase it is; a border belongs to the later one, and what is outside to the nearest."""
        return self.phases[self.index_at(s)]

    def index_at(self, s: float) -> int:
        """The same, counted from 0."""
        return max(bisect.bisect_right(self.starts_s, s) - 1, 0)

    def level_at(self, s: float) -> float:
        """Gravity level that the protocol states for this time [-]."""
        return self.phase_at(s).level_at(s)

    def made_level_at(self, s: float, exo: ExoMode) -> float:
        """Gravity level that the machine is asked for [-]: 1 where it is to carry nothing."""
        return self.level_at(s) if exo == "active" else EARTH

    def approach_s(self, window: int) -> float:
        """When what belongs to this window begins: its ramp, or the opening itself [s]."""
        index = self.phases.index(self.windows[window])
        while index > 0 and self.phases[index - 1].kind is not PhaseKind.REST:
            index -= 1
        return self.phases[index].start_s


def timeline(protocol: Protocol) -> Timeline:
    """Lay out a protocol; where an aircraft or a hand opens the windows, it is what is expected."""
    phases, start_s = list[Phase](), 0.0
    for kind, duration_s, level_from, level_to, window in _stretches(protocol):
        if duration_s > 0.0:
            phases.append(Phase(kind, start_s, duration_s, level_from, level_to, window))
            start_s += duration_s
    return Timeline(protocol, tuple(phases))


Stretch = tuple[PhaseKind, float, float, float, int]


def _stretches(protocol: Protocol) -> Iterator[Stretch]:
    numbers = protocol.windows.numbers
    rests = (protocol.before_first_s, *protocol.rest_lengths_s, protocol.after_last_s)
    for k, number in enumerate(numbers):
        before = list(_before(protocol, number))
        after = list(_after(protocol, numbers[k - 1])) if k else []
        taken = sum(stretch[1] for stretch in (*before, *after))
        yield from after
        yield PhaseKind.REST, rests[k] - taken, EARTH, EARTH, number
        yield from before
        level = protocol.windows.level_of(number)
        yield PhaseKind.WINDOW, protocol.windows.duration_s, level.start, level.end, number
    last = numbers[-1]
    after = list(_after(protocol, last))
    yield from after
    yield PhaseKind.REST, rests[-1] - sum(stretch[1] for stretch in after), EARTH, EARTH, last


def _before(protocol: Protocol, number: int) -> Iterator[Stretch]:
    """What leads from rest to a window."""
    level, ramps, hyper = protocol.windows.level_of(number).start, protocol.ramps, protocol.hypergravity
    if hyper is not None:
        yield PhaseKind.RAMP, hyper.ramp_s, EARTH, (high := level_value(hyper.level)), number
        yield PhaseKind.HYPER, hyper.duration_s, high, high, number
        yield PhaseKind.RAMP, hyper.ramp_s, high, level, number
    elif protocol.exo == "active" and level != EARTH:
        yield PhaseKind.RAMP, ramps.duration_s, EARTH, level, number
        yield PhaseKind.HOLD, ramps.hold_s, level, level, number


def _after(protocol: Protocol, number: int) -> Iterator[Stretch]:
    """What leads back; it is said to belong to the window that comes next."""
    level, ramps, hyper = protocol.windows.level_of(number).end, protocol.ramps, protocol.hypergravity
    following = min(number + 1, protocol.windows.numbers[-1])
    if hyper is not None:
        yield PhaseKind.RAMP, hyper.ramp_s, level, (high := level_value(hyper.level)), following
        yield PhaseKind.HYPER, hyper.duration_s, high, high, following
        yield PhaseKind.RAMP, hyper.ramp_s, high, EARTH, following
    elif protocol.exo == "active" and level != EARTH:
        yield PhaseKind.RAMP, ramps.duration_s, level, EARTH, following
