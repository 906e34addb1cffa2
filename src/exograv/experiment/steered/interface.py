"""What a desk steers: a machine with its guard, in processes of their own or only rehearsed."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Protocol, runtime_checkable

from exograv.model.rig_settings import Side
from exograv.safety.modes import Event, Mode

from .requests import Don
from .view_models import Lateness, Learning, PlotTrace, RecordingStatus, SafeStateName, SkeletonLines


@dataclass(frozen=True)
class FlightMoment:
    """What a flight says of itself; the fields that `Shown` has too mean the same."""

    mode: Mode | None
    """Absent while no guard runs yet."""
    latch: str | None
    safe_state: SafeStateName

    rig: str
    title: str
    side: Side
    sides: tuple[Side, ...]
    is_twin: bool
    participant: str | None
    participants: tuple[str, ...]
    is_known: bool
    is_learned: bool
    """Whether its motion is over too: somebody whose file is there is checked by a short one."""

    joints: tuple[str, ...]
    q_rad: tuple[float, ...]
    v_rad_s: tuple[float, ...]
    tau_desired_Nm: tuple[float, ...]
    tau_commanded_Nm: tuple[float, ...]
    tau_limit_Nm: tuple[float, ...]
    gravity_level_asked: float
    gravity_level: float
    arm_share: float

    lateness: Lateness | None = None
    recorded: RecordingStatus | None = None
    learning: Learning | None = None
    failure: str = ""
    """Why there is no guard any more, and what to do; empty while all is well."""
    warnings: tuple[str, ...] = ()
    """What somebody should know, while it lasts."""
    doing: str = ""
    """What goes on while no guard runs yet."""


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

    def don(self, who: Don) -> str:
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
