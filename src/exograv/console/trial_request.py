"""Request for a protocol in the console, in a form that another process can carry out."""

from dataclasses import dataclass
from pathlib import Path

from exograv.experiment.aircraft import AircraftReceiver
from exograv.options import Side
from exograv.task.levels import EARTH
from exograv.task.plan import TaskPlan
from exograv.task.protocol import load_protocol, refuse_levels

from .feed import receiver_of
from .run_checkpoint import RunCheckpoint, kept_run


@dataclass(frozen=True)
class TrialRequest:
    """Protocol, person and aircraft of a console."""

    folder: Path
    """Folder of the checkpoint."""

    protocol: str | None
    """Name or file of the protocol; None without one: the machine is then only steered."""

    participant: str | None = None
    session: int = 1
    rig: str = "rehearsal"
    resumes: bool = False
    """True to resume the run of an earlier console."""

    aircraft_port: int | None = None
    """UDP port of the aircraft's data; None without an aircraft."""

    aircraft_sender: str | None = None

    def check(self) -> Side | None:
        """Check the request before anything starts; return the side of the arm of a run that is resumed.

        Raises:
            ConfigError: As the other methods.
        """
        self.receiver(self.plan())
        kept = self.checkpoint()
        if kept is None:
            return None
        kept.close()
        return kept.circumstances.side

    def plan(self) -> TaskPlan | None:
        """Plan of the protocol.

        Raises:
            ConfigError: The protocol does not exist, or the machine cannot produce its gravity levels.
        """
        if self.protocol is None:
            return None
        loaded = load_protocol(self.protocol)
        refuse_levels(loaded.settings, EARTH)
        return TaskPlan(loaded, loaded.settings.exo)

    def receiver(self, plan: TaskPlan | None) -> AircraftReceiver | None:
        """Receiver of the aircraft's data; None without an aircraft.

        Raises:
            ConfigError: As `receiver_of`.
        """
        return None if self.aircraft_port is None else receiver_of(plan, self.aircraft_port, self.aircraft_sender)

    def checkpoint(self, is_restart: bool = False) -> RunCheckpoint | None:
        """Checkpoint of the run; a process that replaces another one resumes the run if it had begun.

        Raises:
            ConfigError: As `kept_run`.
        """
        asked = (self.folder, self.protocol, self.participant, self.session, self.rig)
        return kept_run(*asked, self.resumes, is_restart=is_restart)
