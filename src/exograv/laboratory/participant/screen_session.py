"""Session of a participant at a screen: events of screen and aircraft go into the task, its records to all sinks.

The machine is a parameter: full lock-step with control and guard (`experiment/train`), the twin with skipped rests
(`campaigns/virtual_study`), or end points drawn without physics (`campaigns/study_example`).
"""

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Protocol, runtime_checkable

from exograv.task.events import Event, Stop, Tick
from exograv.task.picture import ParticipantPicture, participant_picture
from exograv.task.run import TaskRun

TASK_S = 0.02
"""Time between two updates of the run's time and of the page [s]."""

LEVEL_S = 0.01
"""Time between two updates of the level [s]. The arm's motion in 0.01 s of a ramp cannot be felt."""

EventSource = Callable[[float], Iterable[Event]]
"""Function that returns the events that have arrived until a time [s]. It returns each event once."""


@runtime_checkable
class SessionMachine(Protocol):
    """Machine with a participant in it, and the clock of the session."""

    @property
    def t(self) -> float:
        """Time that the machine has reached [s]."""
        ...

    @property
    def is_settling(self) -> bool:
        """True while the machine must continue after the end of the run."""
        ...

    def advance(self, session: "ScreenSession") -> None:
        """Move on by one step of this machine, and tell the session (`ScreenSession.tell`) at least once."""
        ...

    def why_over(self, run: TaskRun) -> str:
        """Reason to stop a run that no clock ends; empty if it continues."""
        ...


@dataclass
class ScreenSession:
    """Run of a protocol with its event sources and the participant's page."""

    run: TaskRun
    sources: tuple[EventSource, ...]
    """Sources in the order of their evaluation: the touch panel, then the aircraft if there is one."""

    see: Callable[[float, ParticipantPicture], None] | None = None
    """Callback that receives the time [s] and the participant's page after every step."""

    def tell(self, t: float, *noticed: Event) -> None:
        """Advance the run to time `t` [s] and show the participant's page.

        The run first receives the events of all sources up to `t`, then the events `noticed` by the caller, then the
        time.
        """
        for source in self.sources:
            for event in source(t):
                self.run.feed(event)
        for event in (*noticed, Tick(t=t)):
            self.run.feed(event)
        if self.see is not None:
            self.see(t, participant_picture(self.run.plan, self.run.state, t))

    def fly(self, machine: SessionMachine) -> None:
        """Advance the machine until the run has ended and nothing has to settle.

        Raises:
            RigError: The machine was stopped, or the twin diverged.
            RecordingError: The disk is full.
        """
        while self._is_open or machine.is_settling:
            machine.advance(self)
            if self._is_open and not self.run.plan.is_clocked and (why := machine.why_over(self.run)):
                self.run.feed(Stop(t=machine.t, why=why))

    @property
    def _is_open(self) -> bool:
        return self.run.state.status in ("running", "paused")


@runtime_checkable
class Seat(Protocol):
    """Seat of a participant in a machine, in front of a touch panel."""

    @property
    def is_relaxed(self) -> bool | None:
        """True if the participant's muscles give no torque; None if the session cannot see them."""
        ...

    def session(self, run: TaskRun, *others: EventSource) -> ScreenSession:
        """Return the session of this participant. `others` are evaluated after the panel."""
        ...

    def touch(self, t: float) -> None:
        """Detect at `t` [s] if the finger has come down on the panel."""
        ...

    def act(self) -> None:
        """Let the participant's muscles act until the next tick."""
        ...
