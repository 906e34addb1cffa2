"""Interface of a flight that pages steer: a machine with its guard, either in live processes or simulated."""

from collections.abc import Mapping
from typing import Any, Protocol, runtime_checkable

from exograv.model.scene import SceneDescription
from exograv.safety.modes import Event, Mode
from exograv.sentence import SentenceText

from .requests import DonRequest
from .view_models import MachineSnapshot, PlotTrace, SkeletonLines


class FlightMoment(MachineSnapshot):
    """State of a flight: the machine, its mode, and messages for the operator."""

    mode: Mode | None
    """Mode of the guard; absent before a guard runs."""
    latch: SentenceText | None
    is_learned: bool
    """True if no further identification is needed. A person with a file is only checked by a short motion."""

    failure: SentenceText = ""
    """Reason why no guard runs any more, with advice; empty without a failure."""
    warnings: tuple[SentenceText, ...] = ()
    """Sentences for the operator. Each stays as long as its cause."""
    doing: SentenceText = ""
    """Sentence about the preparation before a guard runs."""


@runtime_checkable
class SteeredFlight(Protocol):
    """Flight of one desk. Any thread may call it. A method returns the reason of a refusal, or an empty text."""

    def now(self) -> float:
        """Time of CLOCK_MONOTONIC [s], or of its replacement."""
        ...

    def moment(self) -> FlightMoment:
        """State of the flight. Returns immediately."""
        ...

    def trace(self, since: int) -> PlotTrace:
        """Return the samples to plot from number `since` on, immediately."""
        ...

    def skeleton(self) -> SkeletonLines:
        """Machine and arm as lines. Returns immediately."""
        ...

    def scene(self) -> SceneDescription | None:
        """Describe the picture of machine and person; None before there is one. The page draws it at each position."""
        ...

    def ask(self, event: Event) -> str:
        """Ask the guard for an event, and wait for its answer. Return the reason of a refusal."""
        ...

    def stop(self) -> None:
        """Press Stop, without waiting."""
        ...

    def feel(self, gravity_level: float, ramp_s: float) -> str:
        """Ask for another felt share of the arm's weight, and wait for the guard's answer."""
        ...

    def learn_in_rest(self) -> str:
        """Begin to move the floating arm and to learn it. Return the reason of a refusal; the motion goes on."""
        ...

    def agree(self) -> str:
        """Tell the guard that the participant agrees to a push, and wait for its answer."""
        ...

    def don(self, who: DonRequest) -> str:
        """Start again with another person or another arm. Returns before the start."""
        ...

    def lease(self, until_s: float, window_left_s: float | None) -> None:
        """Tell the guard that a page steers until the time `until_s` [s]. The call does not wait."""
        ...

    def write(self, topic: str, t: float, message: Mapping[str, Any]) -> None:
        """Record a message with time `t` on the clock of `now` [s]."""
        ...

    def close(self) -> None:
        """Let the arm down, and end all processes."""
        ...
