"""Session of `exograv run assist --simulate` with a virtual person, continued from the file of the earlier sessions."""

import time
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

from exograv.laboratory.provenance import run_settings
from exograv.laboratory.support_level.weak_participant import WeakParticipant, prepare_weak_participant
from exograv.loop.pilot import Progress
from exograv.loop.run_settings import RunSettings
from exograv.procedures.rehabilitation.assist.page import write_assist_page
from exograv.procedures.rehabilitation.assist.participant_record import (
    ASSIST_FILE,
    AssistBlock,
    AssistSession,
    opened,
    read_assist,
)
from exograv.procedures.rehabilitation.assist.words import AssistTexts
from exograv.recording import RecordingWriter
from exograv.results import MERGED, json_value
from exograv.task.assist_as_needed import next_session
from exograv.task.assist_protocol import LoadedAssist, load_assist_protocol

from .options import AssistOptions
from .session import fly_session

Told = Callable[[AssistSession, AssistBlock], None]


@dataclass(frozen=True)
class AssistFigures:
    """Findings of a session, as its recording stores them."""

    participant: str
    session: int
    blocks: int
    began_percent: float
    support_percent: float
    next_percent: float
    """Support with which the next session begins."""
    reached: int
    tried: int
    sank: int
    """Blocks that ended because the arm sank."""
    supports_percent: list[float]
    decisions: list[str]
    is_simulated: bool
    rescues: int
    simulated_s: float


@dataclass(frozen=True)
class AssistResult:
    """Result of `exograv run assist`."""

    found: AssistFigures = field(metadata=MERGED)
    file: Path
    page: Path
    recording: Path
    wall_s: float


def assist_file(options: AssistOptions, folder: Path) -> Path:
    """Path of the file with a participant's sessions."""
    return folder / f"assist_{options.participant}.json"


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
    loaded, path = load_assist_protocol(options.protocol), assist_file(options, folder)
    file = read_assist(path, options.participant, options.kept)
    session = opened(file, loaded, options.needed_percent, options.new_session)
    one = prepare_weak_participant(options.person(session.number), progress)
    page = path.with_suffix(".html")
    done, name = len(session.blocks), f"{path.stem}_{session.number:02d}"
    recording_path = folder / (f"{name}.mcap" if done == 0 else f"{name}_from_{done + 1}.mcap")
    settings = _settings(options, one, loaded, session)
    try:
        with RecordingWriter(recording_path, one.laboratory.description.joints, json_value(settings)) as recording:
            flight = one.flight(options.run_seed(session.number, done), recording)

            def keep(now: AssistSession, block: AssistBlock) -> None:
                nonlocal file
                file = file.with_session(now)
                ASSIST_FILE.write(path, file)
                record = {"session": now.number, "block": len(now.blocks), **block.model_dump(mode="json")}
                decided = {"kind": "assist_decided", "record": record | {"text": words.in_all(block)}}
                recording.write("/task", one.known.t + flight.seconds, decided)
                told(now, block)
                show_block(progress, now)

            show_block(progress, session)
            session = fly_session(flight, session, keep)
            flight.carry_all()
            found = figures(options, session, flight.rescues, flight.seconds)
            recording.write("/result", one.known.t + flight.seconds, {"task": json_value(found), "rig": options.rig})
    finally:
        if file.sessions:
            write_assist_page(page, file, words)
    return AssistResult(found, path, page, recording_path, round(time.perf_counter() - start, 1))


def show_block(progress: Progress, session: AssistSession) -> None:
    """Show the block that begins now, and the share of the blocks that are over."""
    done, blocks = len(session.blocks), session.protocol.blocks
    progress(f"Block {min(done + 1, blocks)} of {blocks}", done / blocks)


def figures(options: AssistOptions, session: AssistSession, rescues: int, seconds: float) -> AssistFigures:
    """Count the reached targets, and decide on the next session."""
    following, blocks = next_session(session.protocol.rule, session.state), session.blocks
    return AssistFigures(
        participant=options.participant,
        session=session.number,
        blocks=len(blocks),
        began_percent=session.began_percent,
        support_percent=session.state.support_percent,
        next_percent=following.state.began_percent,
        reached=sum(sum(block.reached) for block in blocks),
        tried=sum(len(block.reached) for block in blocks),
        sank=sum(block.sank for block in blocks),
        supports_percent=[block.support_percent for block in blocks],
        decisions=[block.code for block in blocks],
        is_simulated=True,
        rescues=rescues,
        simulated_s=round(seconds, 1),
    )


def how_to_go_on(options: AssistOptions, folder: Path) -> str:
    """Advice for the continuation after an interruption."""
    path = assist_file(options, folder)
    kept = f"Decided blocks are stored in {path}." if path.exists() else "No block was decided yet."
    return f"{kept} The same command continues this session; --new-session starts another one."


def _settings(
    options: AssistOptions, one: WeakParticipant, loaded: LoadedAssist, session: AssistSession
) -> RunSettings:
    settings = {
        "options": options.kept | {"participant": options.participant, "session": session.number},
        "protocol": loaded.settings,
    }
    command, hashes = "exograv run assist --simulate", {"protocol": loaded.sha256}
    return run_settings(one.laboratory, command, options.level, options.seed, settings, hashes)
