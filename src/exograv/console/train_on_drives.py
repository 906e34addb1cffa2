"""Session of a protocol with a person in a machine on drives, steered at a terminal (`exograv run train --drives`)."""

import sys
import threading
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from pathlib import Path

from exograv.errors import ConfigError
from exograv.experiment.recorded_run import has_window
from exograv.experiment.steered.interface import SteeredFlight
from exograv.experiment.steered.options import SteeredOptions
from exograv.experiment.steered.session_controller import SessionController
from exograv.experiment.train.options import TrainOptions
from exograv.live.options import PersonForm
from exograv.results import MERGED
from exograv.storage.session_readiness import participants_in
from exograv.study.importers.joined_recording import whole_recording
from exograv.study.importers.session_parts import SessionParts, parts_in
from exograv.task.totals import TotalsFigures

from .finished_run import ended_run
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
    """Outcome of the operator's steps; None if the session was ended before, or needed none."""
    diary: Path | None
    """Log of the pages; None if the run needed none."""
    recordings: list[Path]
    """Recordings of the session in order, with those before `--resume`: one for each time that the motors were on."""
    report: Path | None
    """Report of all these recordings; None without a window."""
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
        windows=options.windows,
        allocation=options.allocation,
    )
    before = request.check()
    plan = request.plan()
    if plan is None or plan.exo == "passive" or plan.protocol.opening != "clock":
        raise ConfigError(
            f"Protocol '{options.protocol}' does not open its windows by the clock with active motors. Run it at the "
            f"console: exograv run console --protocol {options.protocol}."
        )
    folder.mkdir(parents=True, exist_ok=True)
    report = folder / f"{options.name}.html"
    if (ended := ended_run(request, report)) is not None:
        return _training(options, request, report, say, ended.is_finished, None, None, ended.totals)
    stated = request.stated()
    steered = replace(steered, run=stated, rests=before.rests, allocation_sha256=request.allocation_sha256)
    desk = SessionController(flight_of(steered, person, folder, "run train", say))
    outcome: list[SessionOutcome] = []

    def operate(link: str, is_over: threading.Event) -> None:
        page = TerminalPage(link, address.certificate)
        try:
            is_automatic = options.simulate and not sys.stdin.isatty()
            keyboard = Keyboard(say, is_over, is_automatic)
            awaits_page = options.stimulus is not None
            session = TerminalSession(page, keyboard, options.resume, awaits_page, options.learn_in_rests)
            outcome.append(session.run())
        except SessionEndedError:
            say("The session was ended before its end.")
        finally:
            page.close()

    result = run_console(address, folder, desk, request, say, operate)
    done = outcome[0] if outcome else None
    is_complete = done is not None and done.finished
    return _training(options, request, report, say, is_complete, done, result.diary, result.totals)


def _training(
    options: TrainOptions,
    request: TrialRequest,
    report: Path,
    say: Say,
    is_complete: bool,
    preparation: SessionOutcome | None,
    diary: Path | None,
    totals: TotalsFigures | None,
) -> DrivenTraining:
    """Write the report of a session, and return its result."""
    stated = request.stated()
    parts = SessionParts(()) if stated is None else parts_in(request.folder, stated.now().run)
    return DrivenTraining(
        participant=options.participant,
        protocol=options.protocol,
        session=options.session,
        is_complete=is_complete,
        preparation=preparation,
        diary=diary,
        recordings=list(parts.recordings),
        report=_reported(parts, report, say),
        totals=totals,
    )


def _reported(parts: SessionParts, report: Path, say: Say) -> Path | None:
    """Write the report of all recordings of the session, if one of them has a window."""
    if not any(has_window(path) for path in parts.recordings):
        return None
    say("Writing the report.")
    from exograv.report.of_recording.recording_report import write_report  # Matplotlib: 0.4 s

    with whole_recording(parts, report.parent, report.stem) as path:
        return write_report(path, report)


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
        windows=options.windows,
        protocol_of_stimulus=options.protocol,
    )
