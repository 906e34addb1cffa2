"""Request for a protocol in the console, in a form that another process can carry out."""

from dataclasses import dataclass, field
from pathlib import Path
from secrets import token_hex

from exograv.experiment.aircraft import AircraftReceiver
from exograv.experiment.train.request import read_allocation
from exograv.options import OptionRecord
from exograv.safety.guard import GRAVITY_LEVEL_MAX
from exograv.storage.stated_run import StatedRun
from exograv.task.allocation import exo_for, group_of
from exograv.task.plan import TaskPlan
from exograv.task.protocol import first_windows, load_protocol, refuse_levels
from exograv.task.run_statement import RunStatement

from .feed import receiver_of
from .run_checkpoint import RunCheckpoint, RunContext, kept_run, run_path


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

    windows: int | None = None
    """Number of windows of a trial; None for the whole protocol."""

    allocation: Path | None = None
    """Sealed list of groups of the study; None without one."""

    launch: str = field(default_factory=lambda: token_hex(8))
    """Random name of this command, and of a run that begins with it."""

    def check(self) -> RunContext:
        """Check the request before anything starts; return the conditions of a run that is resumed.

        Raises:
            ConfigError: As the other methods.
        """
        self.receiver(self.plan())
        kept = self.checkpoint()
        if kept is None:
            return RunContext()
        kept.close()
        return kept.circumstances

    def plan(self) -> TaskPlan | None:
        """Plan of the protocol.

        Raises:
            ConfigError: The protocol does not exist, the machine cannot produce its gravity levels, or the list of
                groups cannot be used.
        """
        if self.protocol is None:
            return None
        loaded = load_protocol(self.protocol)
        refuse_levels(loaded.settings, GRAVITY_LEVEL_MAX)
        exo = exo_for(loaded.settings, None)
        if self.allocation is not None:
            exo = exo_for(loaded.settings, group_of(read_allocation(self.allocation)[0], self.participant or ""))
        return TaskPlan(loaded if self.windows is None else first_windows(loaded, self.windows), exo)

    @property
    def allocation_sha256(self) -> str | None:
        """Hash of the list of groups; None without one.

        Raises:
            ConfigError: The list cannot be used.
        """
        return None if self.allocation is None else read_allocation(self.allocation)[1]

    def stated(self) -> StatedRun | None:
        """Return the statement about the run for its recordings and diaries; None without a protocol.

        Raises:
            ConfigError: As `plan`.
        """
        plan = self.plan()
        if plan is None or self.protocol is None:
            return None
        path = run_path(self.folder, self.protocol, self.participant, self.session, self.windows)
        begun = RunStatement(
            run=self.launch, launch=self.launch, participant=self.participant, protocol=plan.protocol.name,
            protocol_sha256=plan.loaded.sha256, session=self.session,
        )  # fmt: skip
        return StatedRun(path, begun)

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
        part: OptionRecord = {"windows": self.windows, "allocation": self.allocation_sha256}
        return kept_run(*asked, self.resumes, is_restart, part)
