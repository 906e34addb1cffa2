"""Files of a participant's sessions: read, continued after each block, and shown on the page."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol, runtime_checkable

from exograv.loop.pilot import Progress
from exograv.options import OptionRecord
from exograv.task.assist_as_needed import next_session
from exograv.task.assist_protocol import LoadedAssist, load_assist_protocol

from .options import AssistOptions
from .page import write_assist_page
from .participant_record import ASSIST_FILE, AssistBlock, AssistSession, opened, read_assist
from .session import Attempts, fly_session
from .words import AssistTexts

Told = Callable[[AssistSession, AssistBlock], None]


@runtime_checkable
class AssistFlight(Attempts, Protocol):
    """Flight of a session, such as a `SupportFlight`."""

    rescues: int

    @property
    def seconds(self) -> float:
        """Time since the start of the session [s]."""
        ...

    def carry_all(self) -> None:
        """Carry the whole weight again."""
        ...


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
    """Duration of the session on the machine's clock [s]."""


def assist_file(options: AssistOptions, folder: Path) -> Path:
    """Path of the file with a participant's sessions."""
    return folder / f"assist_{options.participant}.json"


class SessionFiles:
    """File of one participant's sessions, with the session that is flown now."""

    def __init__(self, options: AssistOptions, kept: OptionRecord, folder: Path):
        """Read the file, and open the interrupted session or the next one.

        Args:
            options: Options of the command.
            kept: Machine and person, which must be the same in all sessions.
            folder: Folder of the file.

        Raises:
            ConfigError: The protocol or the file cannot be used.
        """
        self.loaded: LoadedAssist = load_assist_protocol(options.protocol)
        self.path = assist_file(options, folder)
        self._file = read_assist(self.path, options.participant, kept)
        self.session = opened(self._file, self.loaded, options.needed_percent, options.new_session)
        """Session that is flown now, with its decided blocks."""
        self._options = options

    @property
    def page(self) -> Path:
        """Page of the therapist."""
        return self.path.with_suffix(".html")

    @property
    def recording_name(self) -> str:
        """Name of the recording of the session, or of its remaining part."""
        name, done = f"{self.path.stem}_{self.session.number:02d}", len(self.session.blocks)
        return f"{name}.mcap" if done == 0 else f"{name}_from_{done + 1}.mcap"

    def fly(
        self,
        flight: AssistFlight,
        note: Callable[[Mapping[str, Any]], object],
        words: AssistTexts,
        told: Told,
        progress: Progress,
        is_simulated: bool,
    ) -> AssistFigures:
        """Run the remaining blocks, store each of them, and carry the whole arm again.

        Args:
            flight: Flight with the person.
            note: Function that records a message about the task.
            words: Texts of the decisions.
            told: Receives each block after its decision.
            progress: Receives the progress of the blocks.
            is_simulated: True if the person is simulated.

        Raises:
            RigError: The machine was stopped. Decided blocks are stored.
            KeyboardInterrupt: Ctrl-C was pressed. Decided blocks are stored.
        """

        def keep(now: AssistSession, block: AssistBlock) -> None:
            self.session, self._file = now, self._file.with_session(now)
            ASSIST_FILE.write(self.path, self._file)
            record = {"session": now.number, "block": len(now.blocks), **block.model_dump(mode="json")}
            note({"kind": "assist_decided", "record": record | {"text": words.in_all(block)}})
            told(now, block)
            show_block(progress, now)

        show_block(progress, self.session)
        self.session = fly_session(flight, self.session, keep)
        flight.carry_all()
        return figures(self._options, self.session, flight.rescues, flight.seconds, is_simulated)

    def write_page(self, words: AssistTexts) -> None:
        """Write the page, if there is a decided block.

        Raises:
            RecordingError: The folder cannot be written.
        """
        if self._file.sessions:
            write_assist_page(self.page, self._file, words)


def show_block(progress: Progress, session: AssistSession) -> None:
    """Show the block that begins now, and the share of the blocks that are over."""
    done, blocks = len(session.blocks), session.protocol.blocks
    progress(f"Block {min(done + 1, blocks)} of {blocks}", done / blocks)


def figures(
    options: AssistOptions, session: AssistSession, rescues: int, seconds: float, is_simulated: bool
) -> AssistFigures:
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
        is_simulated=is_simulated,
        rescues=rescues,
        simulated_s=round(seconds, 1),
    )


def how_to_go_on(options: AssistOptions, folder: Path) -> str:
    """Advice for the continuation after an interruption."""
    path = assist_file(options, folder)
    kept = f"Decided blocks are stored in {path}." if path.exists() else "No block was decided yet."
    return f"{kept} The same command continues this session; --new-session starts another one."
