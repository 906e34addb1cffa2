"""Session of `exograv run assist` with a virtual person, continued from the file of the earlier sessions."""

import time
from dataclasses import dataclass, field
from pathlib import Path

from exograv.laboratory.provenance import run_settings
from exograv.laboratory.support_level.weak_participant import WeakParticipant, prepare_weak_participant
from exograv.loop.pilot import Progress
from exograv.loop.run_settings import RunSettings
from exograv.procedures.rehabilitation.assist.options import AssistOptions
from exograv.procedures.rehabilitation.assist.session_files import AssistFigures, SessionFiles, Told
from exograv.procedures.rehabilitation.assist.words import AssistTexts
from exograv.recording import RecordingWriter
from exograv.results import MERGED, json_value


@dataclass(frozen=True)
class AssistResult:
    """Result of `exograv run assist`."""

    found: AssistFigures = field(metadata=MERGED)
    file: Path
    page: Path
    recording: Path
    wall_s: float


def run_assist(
    options: AssistOptions, folder: Path, words: AssistTexts, told: Told, progress: Progress
) -> AssistResult:
    """Run one session, or the remaining part of it. The page is written also after an error.

    Args:
        options: Options of the command.
        folder: Folder of the participant's file, the recordings and the page.
        words: Texts of the page.
        told: Receives each block after its decision.
        progress: Receives the progress of the preparation, then of the blocks.

    Raises:
        ConfigError: An option, a file or the machine is not valid.
        RigError: The envelope stopped the run. Decided blocks are stored.
        RecordingError: The folder cannot be written.
        KeyboardInterrupt: Ctrl-C was pressed. Decided blocks are stored.
    """
    start = time.perf_counter()
    files = SessionFiles(options, options.kept, folder)
    number, done, recording_path = files.session.number, len(files.session.blocks), folder / files.recording_name
    one = prepare_weak_participant(options.person(number), progress)
    settings = _settings(options, one, files)
    try:
        with RecordingWriter(recording_path, one.laboratory.description.joints, json_value(settings)) as recording:
            flight = one.flight(options.run_seed(number, done), recording)
            found = files.fly(
                flight,
                lambda message: recording.write("/task", one.known.t + flight.seconds, message),
                words,
                told,
                progress,
                is_simulated=True,
            )
            recording.write("/result", one.known.t + flight.seconds, {"task": json_value(found), "rig": options.rig})
    finally:
        files.write_page(words)
    return AssistResult(found, files.path, files.page, recording_path, round(time.perf_counter() - start, 1))


def _settings(options: AssistOptions, one: WeakParticipant, files: SessionFiles) -> RunSettings:
    settings = {
        "options": options.kept | {"participant": options.participant, "session": files.session.number},
        "protocol": files.loaded.settings,
    }
    command, hashes = "exograv run assist --simulate", {"protocol": files.loaded.sha256}
    return run_settings(one.laboratory, command, options.level, options.seed, settings, hashes)
