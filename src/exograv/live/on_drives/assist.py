"""Session of assist as needed on drives (`exograv run assist --drives`): live identification, then the blocks."""

import time
from dataclasses import dataclass, field
from pathlib import Path

from exograv.live.live_figures import LiveFigures
from exograv.live.options import PersonForm
from exograv.loop.floating_machine import FloatingMachine
from exograv.loop.pilot import Progress
from exograv.model.description import load_rig
from exograv.options import OptionRecord
from exograv.procedures.bring_up.hands import Hands
from exograv.procedures.identification.simulated_wearer import SimulatedWearer
from exograv.procedures.rehabilitation.assist.options import AssistOptions
from exograv.procedures.rehabilitation.assist.session_files import AssistFigures, SessionFiles, Told
from exograv.procedures.rehabilitation.assist.words import AssistTexts
from exograv.procedures.rehabilitation.support_level.flight import SupportFlight
from exograv.procedures.rehabilitation.support_level.instructed_person import person_of
from exograv.procedures.rehabilitation.support_level.targets import refuse_without_targets
from exograv.results import MERGED, json_value

from .arm_files import arm_of_session
from .connection import Say
from .float_command import Procedure, fly_on_drives
from .support_level import live_options

SESSION_MAX_S = 3600.0
"""Longest session [s], after which the arm is let down: three times the longest session in the twin."""


@dataclass(frozen=True)
class AssistOnDrives:
    """Result of `exograv run assist` on drives."""

    found: AssistFigures = field(metadata=MERGED)
    file: Path
    page: Path
    recording: Path
    wall_s: float
    live: LiveFigures


def run_assist_on_drives(
    options: AssistOptions,
    person: PersonForm,
    folder: Path,
    words: AssistTexts,
    told: Told,
    progress: Progress,
    say: Say,
    wearer: SimulatedWearer | None = None,
) -> AssistOnDrives:
    """Identify the arm of a person in a machine on drives, and run one session, or the remaining part of it.

    The first session stores the arm in the person's file, and the next ones only check it, as in `run train`.

    Raises:
        ExogravError: The machine is not ready, or a file or an option cannot be used.
        RigError: The machine was stopped. Decided blocks are stored.
    """
    start = time.perf_counter()
    description = load_rig(options.rig, options.side)
    refuse_without_targets(description)
    of_arm = arm_of_session(options.participant, options.participants, folder)
    files = SessionFiles(options, kept_on_drives(options), folder)
    number, done, recording = files.session.number, list[AssistFigures](), folder / files.recording_name

    def fly(machine: FloatingMachine, hands: Hands, shown: Progress) -> None:
        flight = SupportFlight(machine, person_of(hands, say), description.side)
        found = files.fly(
            flight,
            lambda message: machine.write("/task", machine.t, message),
            words,
            told,
            shown,
            is_simulated=options.simulate,
        )
        done.append(found)
        machine.write("/result", machine.t, {"task": json_value(found), "rig": options.rig})

    simulation, live = options.person(number).simulation, live_options(options, options.identify_s, SESSION_MAX_S)
    procedure = Procedure(
        "run assist", files=of_arm, simulation=simulation, recording_name=recording.name, performs=fly
    )
    try:
        run = fly_on_drives(live, person, folder, progress, say, wearer, procedure)
    finally:
        files.write_page(words)
    wall_s = round(time.perf_counter() - start, 1)
    return AssistOnDrives(done[-1], files.path, files.page, recording, wall_s, run.figures)


def kept_on_drives(options: AssistOptions) -> OptionRecord:
    """Options that must be the same in all sessions of a person: of a simulated person all, of a real one the machine.

    A file of a twin has no entry `drives`, so that no session in a machine continues one in the twin.
    """
    if options.simulate:
        return options.kept | {"drives": "simulated"}
    return {"rig": options.rig, "side": options.side, "drives": "real"}
