"""Schedule of a protocol: phases, windows, and gravity level at any time."""

import bisect
import enum
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property

from .levels import EARTH, slewing_s
from .protocol_schema import ExoMode, Hypergravity, Protocol, level_value


class PhaseKind(enum.Enum):
    """Purpose of a phase. The value is the word in records."""

    REST = "rest"
    RAMP = "ramp"
    """Change of the level."""

    HOLD = "hold"
    """Constant level between the ramp and the opening of the window."""

    WINDOW = "window"
    HYPER = "hyper"
    """Level of an aircraft's pull-up."""


@dataclass(frozen=True)
class Phase:
    """Phase of the schedule. Its level changes linearly."""

    kind: PhaseKind
    start_s: float
    """Start on the schedule's own clock, which begins with the first rest [s]."""

    duration_s: float
    level_from: float
    level_to: float
    """Felt share of Earth weight at the end, as the protocol states it [-]."""

    window: int
    """Number of the window, or of the next one. After the last window: its number."""

    @property
    def end_s(self) -> float:
        """End of the phase, and start of the next one [s]."""
        return self.start_s + self.duration_s

    def level_at(self, s: float) -> float:
        """Level at a time in the phase [-]."""
        share = (s - self.start_s) / self.duration_s if self.duration_s > 0.0 else 1.0
        return self.level_from + min(max(share, 0.0), 1.0) * (self.level_to - self.level_from)


@dataclass(frozen=True)
class Timeline:
    """All phases in sequence, without gaps."""

    protocol: Protocol
    phases: tuple[Phase, ...]

    @property
    def duration_s(self) -> float:
        """Time from the first rest to the end of the last one [s]."""
        return self.phases[-1].end_s

    @cached_property
    def windows(self) -> dict[int, Phase]:
        """Windows by their number."""
        return {phase.window: phase for phase in self.phases if phase.kind is PhaseKind.WINDOW}

    @cached_property
    def pushes_s(self) -> tuple[tuple[float, float], ...]:
        """Start and end of each time in which the level is above Earth [s]."""
        found = list[tuple[float, float]]()
        for phase in self.phases:
            if max(phase.level_from, phase.level_to) > EARTH:
                goes_on = bool(found) and found[-1][1] == phase.start_s
                begin = found.pop()[0] if goes_on else phase.start_s
                found.append((begin, phase.end_s))
        return tuple(found)

    @cached_property
    def starts_s(self) -> tuple[float, ...]:
        """Start of each phase [s]."""
        return tuple(phase.start_s for phase in self.phases)

    def phase_at(self, s: float) -> Phase:
        """Phase at `s`. A limit belongs to the later phase; times outside belong to the nearest phase."""
        return self.phases[self.index_at(s)]

    def index_at(self, s: float) -> int:
        """Index of the phase at `s`, from 0."""
        return max(bisect.bisect_right(self.starts_s, s) - 1, 0)

    def level_at(self, s: float) -> float:
        """Gravity level that the protocol states for this time [-]."""
        return self.phase_at(s).level_at(s)

    def made_level_at(self, s: float, exo: ExoMode) -> float:
        """Gravity level that the task requests from the machine [-]; 1 if the machine carries nothing."""
        return self.level_at(s) if exo == "active" else EARTH

    def approach_s(self, window: int) -> float:
        """Start of the approach to this window: its ramp, or the opening itself [s]."""
        index = self.phases.index(self.windows[window])
        while index > 0 and self.phases[index - 1].kind is not PhaseKind.REST:
            index -= 1
        return self.phases[index].start_s


def timeline(protocol: Protocol) -> Timeline:
    """Lay out a protocol in time. If an aircraft or the operator opens the windows, the times are expected ones."""
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
    """Yield the phases between rest and window."""
    level, ramps, hyper = protocol.windows.level_of(number).start, protocol.ramps, protocol.hypergravity
    if hyper is not None:
        for kind, duration_s, begin, end in _pull_up(protocol, hyper, level):
            yield kind, duration_s, begin, end, number
    elif protocol.exo == "active" and level != EARTH:
        yield PhaseKind.RAMP, ramps.duration_s, EARTH, level, number
        yield PhaseKind.HOLD, ramps.hold_s, level, level, number


def _after(protocol: Protocol, number: int) -> Iterator[Stretch]:
    """Yield the phases between a window and rest. They have the number of the next window."""
    level, ramps, hyper = protocol.windows.level_of(number).end, protocol.ramps, protocol.hypergravity
    following = min(number + 1, protocol.windows.numbers[-1])
    if hyper is not None:
        for kind, duration_s, begin, end in reversed(_pull_up(protocol, hyper, level)):
            yield kind, duration_s, end, begin, following
    elif protocol.exo == "active" and level != EARTH:
        yield PhaseKind.RAMP, ramps.duration_s, level, EARTH, following


def _pull_up(protocol: Protocol, hyper: Hypergravity, level: float) -> list[tuple[PhaseKind, float, float, float]]:
    """Return the phases from Earth over hypergravity to a window's level: kind, duration [s], first and last level.

    A machine's ramps are no steeper than allowed; the pull-up is shorter by what they take longer.
    """
    high = level_value(hyper.level)
    up_s = down_s = hyper.ramp_s
    if protocol.exo == "active":
        up_s, down_s = max(up_s, slewing_s(EARTH, high)), max(down_s, slewing_s(high, level))
    return [
        (PhaseKind.RAMP, up_s, EARTH, high),
        (PhaseKind.HYPER, hyper.duration_s + 2.0 * hyper.ramp_s - up_s - down_s, high, high),
        (PhaseKind.RAMP, down_s, high, level),
    ]
