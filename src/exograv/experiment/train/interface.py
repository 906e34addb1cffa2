"""Machine of a session in lock-step, with its participant: the twin, or drives with a participant behind them."""

from collections.abc import Callable
from typing import Protocol, runtime_checkable

from exograv.laboratory.participant.screen_session import EventSource, Seat
from exograv.loop.run_settings import RunSettings
from exograv.model.description import RigDescription
from exograv.procedures.identification.participant_session import ParticipantRun
from exograv.recording import RecordingWriter
from exograv.results import JsonObject
from exograv.storage.session_checkpoint import KeptSession, LearnedState
from exograv.task.plan import TaskPlan
from exograv.task.screen import ScreenCalibration

from .preparation import Ready


@runtime_checkable
class TrainingMachine(Protocol):
    """Machine that runs a protocol's windows on its own clock, each tick as soon as the last one is computed."""

    description: RigDescription
    day: int
    """Seed of everything that is drawn anew at each donning."""
    screen: ScreenCalibration
    """Calibration of the participant's screen."""

    def refuse_files(self) -> None:
        """Check the files of machine and person, before the recording begins and not after minutes of preparation.

        Raises:
            ExogravError: A file cannot be used, or the machine is not ready.
        """
        ...

    def person_run(self) -> ParticipantRun:
        """Read the participant's file, if there is one.

        Raises:
            ConfigError: The file cannot be used.
        """
        ...

    def settings(self, settings: JsonObject, hashes: dict[str, str]) -> RunSettings:
        """Describe the run for its recording.

        Args:
            settings: Settings of the run itself, by name.
            hashes: Hashes of the files that were read, by their kind.
        """
        ...

    def ready(self, recording: RecordingWriter, before: KeptSession | None, t: float) -> Ready:
        """Prepare machine and arm for the windows, from the rig time `t` on [s].

        Args:
            recording: Recording of the session.
            before: Checkpoint of an interrupted session; None for a new one.
            t: Start of the rig's clock [s]; 0 for a new session.

        Raises:
            ExogravError: Machine, wearer or run was refused or stopped.
        """
        ...

    def seat(self, plan: TaskPlan, page: str, learned: LearnedState | None) -> Seat:
        """Seat the participant before the screen.

        Args:
            plan: Protocol of the session.
            page: Identifier of the participant's page.
            learned: State of the participant from before an interruption; None without one.
        """
        ...

    @property
    def learned(self) -> LearnedState | None:
        """State that the participant keeps between sessions; None before the first touch."""
        ...

    @property
    def pass_time(self) -> Callable[[float], object] | None:
        """Function that lets time [s] pass while nothing moves; None if the machine's clock passes by ticks only."""
        ...

    def sources(self, recording: RecordingWriter) -> tuple[EventSource, ...]:
        """Return the sources of events beside the touch panel, such as an aircraft."""
        ...

    def close(self) -> None:
        """Release the machine, and end its processes."""
        ...
