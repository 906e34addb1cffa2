"""What a desk steers: a machine with its guard, in processes of their own or only rehearsed."""

from collections.abc import Mapping
from typing import Any, Protocol, runtime_checkable

from exograv.safety.modes import Event, Mode
from exograv.sentence import SentenceText

from .requests import DonRequest
from .view_models import MachineSnapshot, PlotTrace, SkeletonLines


class FlightMoment(MachineSnapshot):
    """State of a flight: the machine, its mode, and what the operator has to know."""

    mode: Mode | None
    """Absent while no guard runs yet."""
    latch: SentenceText | None
    is_learned: bool
    """True if the identification is over too: a person whose file is there is checked by a short motion."""

    failure: SentenceText = ""
    """Why there is no guard any more, and what to do; empty while all is well."""
    warnings: tuple[SentenceText, ...] = ()
    """Sentences for the operator, while their cause lasts."""
    doing: SentenceText = ""
    """Sentence for what goes on while no guard runs yet."""


@runtime_checkable
class SteeredFlight(Protocol):
    """Called by one desk, from any thread. What is refused is answered with a sentence, what is done with nothing."""

    def now(self) -> float:
        """CLOCK_MONOTONIC [s], or what stands for it."""
        ...

    def moment(self) -> FlightMoment:
        """At once."""
        ...

    def trace(self, since: int) -> PlotTrace:
        """At once."""
        ...

    def skeleton(self) -> SkeletonLines:
        """At once."""
        ...

    def ask(self, event: Event) -> str:
        """Let the guard decide whether this may happen; waits for its word."""
        ...

    def stop(self) -> None:
        """Press Stop; waits for nothing."""
        ...

    def feel(self, gravity_level: float, ramp_s: float) -> str:
        """Have another share of the arm's weight felt; waits for the guard's word."""
        ...

    def don(self, who: DonRequest) -> str:
        """Begin with somebody else, or another arm; returns before that has begun."""
        ...

    def lease(self, until_s: float, window_left_s: float | None) -> None:
        """Tell the guard that somebody steers until then [s]; waits for nothing."""
        ...

    def write(self, topic: str, t: float, message: Mapping[str, Any]) -> None:
        """Have a message of this time of `now` [s] recorded."""
        ...

    def close(self) -> None:
        """The arm comes down, all ends."""
        ...
