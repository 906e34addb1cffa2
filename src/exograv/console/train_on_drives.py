"""Session of a protocol with a person in a machine on drives, steered at a terminal (`exograv run train --drives`)."""

import sys
import threading
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from exograv.errors import ConfigError
from exograv.experiment.recorded_run import has_window
from exograv.experiment.steered.interface import SteeredFlight
from exograv.experiment.steered.live_session import recordings_in
from exograv.experiment.steered.options import SteeredOptions
from exograv.experiment.steered.session_controller import SessionController
from exograv.experiment.train.options import TrainOptions
from exograv.live.options import PersonForm
from exograv.results import MERGED
from exograv.storage.session_readiness import participants_in
from exograv.task.totals import TotalsFigures

from .options import Address
from .page_supervisor import Say
from .run import run_console
from .terminal_page import TerminalPage
from .terminal_session import Keyboard, SessionEndedError, SessionOutcome, TerminalSession
from .trial_request import TrialRequest

RECORDING_S = 7200.0
"""Longest recording of a session [s]: 31 windows with their rests take 1 h 50 min."""


@dataclass(frozen=True)
class DrivenTraining:
    """Result of a session on drives."""

    participant: str
    protocol: str
    session: int
    is_complete: bool
    """True if the protocol has come to its end."""
    preparation: SessionOutcome | None
    """Outcome of the operator's steps; None if the session was ended before."""
    diary: Path
    """Log of the pages."""
    recordings: list[Path]
    """Recordings of the session in order: one for each time that the motors were on."""
    report: Path | None
    """Report of the last recording with a window; None without one."""
    totals: TotalsFigures | None = field(metadata=MERGED)


FlightOf = Callable[[SteeredOptions, PersonForm, Path, str, Say], SteeredFlight]
"""Function that starts the flight of a session: options, form, folder, command, and a function that shows a line."""


def run_training_on_drives(
    options: TrainOptions, person: PersonForm, address: Address, folder: Path, say: Say, flight_of: FlightOf
) -> DrivenTraining:
    """Run a session on a machine that is ready, with the steps of the operator's page at the terminal.

    Raises:
        ExogravError: The machine is not ready, an option cannot be used, or the machine has stopped.
    """
    address.check()
    if not (options.simulate or sys.stdin.isatty()):
        raise ConfigError("A session needs an operator at the keyboard: run it in a terminal, or with --simulate.")
    steered = _steered(options, folder)
    request = TrialRequest(
        folder=folder,
        protocol=options.protocol,
        participant=options.participant,
        session=options.session,
        rig=steered.rig,
        resumes=options.resume,
    )
    request.check()
    plan = request.plan()
    if plan is None or plan.exo != "active" or plan.protocol.opening != "clock":
        raise ConfigError(
            f"Protocol '{options.protocol}' does not open its windows by the clock with active motors. Run it at the "
            f"console: exograv run console --protocol {options.protocol}."
        )
    folder.mkdir(parents=True, exist_ok=True)
    before = set(recordings_in(folder))
    desk = SessionController(flight_of(steered, person, folder, "run train", say))
    outcome: list[SessionOutcome] = []

    def operate(link: str, is_over: threading.Event) -> None:
        page = TerminalPage(link, address.certificate)
        try:
            is_automatic = options.simulate and not sys.stdin.isatty()
            keyboard = Keyboard(say, is_over, is_automatic)
            outcome.append(TerminalSession(page, keyboard, options.resume, options.stimulus is not None).run())
        except SessionEndedError:
            say("The session was ended before its end.")
        finally:
            page.close()

    result = run_console(address, folder, desk, request, say, operate)
    recordings = [path for path in recordings_in(folder) if path not in before]
    return DrivenTraining(
        participant=options.participant,
        protocol=options.protocol,
        session=options.session,
        is_complete=bool(outcome) and outcome[0].finished,
        preparation=outcome[0] if outcome else None,
        diary=result.diary,
        recordings=recordings,
        report=_reported(recordings, folder / f"{options.name}.html", say),
        totals=result.totals,
    )


def _reported(recordings: Sequence[Path], report: Path, say: Say) -> Path | None:
    """Write the report of the last recording with a window, if there is one."""
    with_windows = [path for path in recordings if has_window(path)]
    if not with_windows:
        return None
    say("Writing the report.")
    from exograv.report.of_recording.recording_report import write_report  # Matplotlib: 0.4 s

    return write_report(with_windows[-1], report)


def _steered(options: TrainOptions, folder: Path) -> SteeredOptions:
    return SteeredOptions(
        rig=options.rig or SteeredOptions.rig,
        side=options.side,
        level=options.level,
        world=options.world,
        seed=options.seed,
        drives=options.drives,
        simulate=options.simulate,
        real_time=options.real_time,
        calibration=options.calibration,
        participants=options.participants or participants_in(folder),
        participant=options.participant,
        session_s=RECORDING_S,
        donning=options.donning,
        lsl=options.lsl,
        record_streams=options.record_streams,
        stimulus=options.stimulus,
        protocol_of_stimulus=options.protocol,
    )
