"""Erasure of a participant who withdraws consent: all data under the code are removed, and a search proves it.

Data that were computed from all participants are removed too: the tables lose the person's rows; findings, report and
exports in the folder are removed completely. The disk may keep deleted blocks, and backups and other copies are out of
reach. The receipt states this.
"""

import json
import secrets
import shutil
from dataclasses import asdict, dataclass, field
from datetime import UTC, datetime
from pathlib import Path

from exograv.errors import ConfigError, RecordingError
from exograv.files import write_whole
from exograv.study.folder.columns import TABLES
from exograv.study.folder.journal import alone, note
from exograv.study.folder.settings import read_settings
from exograv.study.folder.study_folder import StudyFolder
from exograv.study.participants.register import read_register, write_register
from exograv.study.participants.searching import files_with, has_word

from .making import refresh
from .quarantine import quarantined
from .sources import Source, placed_sources, remove_partial

EXPORT = "dataset_description.json"
"""File that marks a folder as an export."""


@dataclass(frozen=True)
class Receipt:
    """Receipt of an erasure, without the code."""

    number: str
    """Random number of the receipt. It does not identify the person."""

    at: str
    sessions: int
    quarantined: int
    files: int
    """Number of all removed files."""

    log_lines: int
    exports: int
    """Number of exported data sets that were removed from the folder and have to be exported again."""

    left: tuple[str, ...]
    """Files in which the code still occurs; empty if the search proves that there is none."""

    not_attributed: int
    """Number of files in quarantine that cannot be read and whose participant is not known."""

    is_proved: bool = field(init=False)
    """True if the search found nothing."""

    sentence: str = field(init=False)
    """Description of the erasure for the participant who requested it."""

    def __post_init__(self):
        object.__setattr__(self, "is_proved", not self.left)
        object.__setattr__(self, "sentence", self._sentence())

    def _sentence(self) -> str:
        proof = (
            "A search of all names and contents in the folder did not find the code."
            if self.is_proved
            else f"The code still occurs in {', '.join(self.left)}: remove these files by hand."
        )
        more = f" {self.exports} exports were removed: export again." if self.exports else ""
        if self.not_attributed:
            more += f" {self.not_attributed} unreadable files in quarantine have no known participant: check them."
        return (
            f"{self.sessions} sessions and {self.files} files were erased. {proof}{more} Backups, copies elsewhere and "
            f"the identity (exograv study identity) were not changed. Receipt {self.number}."
        )


def erase(folder: StudyFolder, code: str) -> Receipt:
    """Erase a participant. After an interruption the same command continues.

    Raises:
        ConfigError: The folder is no study, does not contain the code, or another command is changing it.
        RecordingError: A file cannot be removed.
    """
    read_settings(folder)
    with alone(folder):
        remove_partial(folder)
        sources = placed_sources(folder)
        words = [code, *_old_codes(sources, code)]
        if not any(True for _ in files_with(folder.path, [code])):
            raise ConfigError(f"{folder.path} contains nothing of {code}. Check the code.")
        sessions = sum(source.note.participant == code for source in sources)
        aside = [sha256 for sha256, why in quarantined(folder).items() if why.participant == code]
        removed, exports = _remove(folder, code, aside)
        lines = _strip_log(folder, words)
        write_register(folder, [row for row in read_register(folder) if row.code != code])
        refresh(folder)
        left = tuple(f"{path.relative_to(folder.path)} ({where})" for path, where in files_with(folder.path, words))
        orphans = sum(why.participant is None for why in quarantined(folder).values())
        at = datetime.now(UTC).replace(microsecond=0).isoformat()
        receipt = Receipt(secrets.token_hex(4), at, sessions, len(aside), removed, lines, exports, left, orphans)
        path = folder.path / "receipts" / f"erased-{receipt.number}.json"
        write_whole(path, json.dumps(asdict(receipt), ensure_ascii=False, indent=1) + "\n")
        note(folder, "erased", f"A participant was erased: receipt {receipt.number}.")
    return receipt


def _old_codes(sources: list[Source], code: str) -> list[str]:
    """Return codes in the person's files that no other participant has."""
    mine = {source.note.recorded_as for source in sources if source.note.participant == code}
    others = {source.note.recorded_as for source in sources if source.note.participant != code}
    return sorted(old for old in mine - others if old is not None)


def _remove(folder: StudyFolder, code: str, aside: list[str]) -> tuple[int, int]:
    """Remove everything of the code and everything made from all data; return the numbers of files and exports."""
    found = {path.parent for path in folder.path.rglob(EXPORT) if path.parent != folder.path}
    exports = [path for path in sorted(found) if not found & set(path.parents)]
    whole = [folder.sources / code, folder.report, *exports]
    # The tables lose the person's rows when they are made again, without reading all recordings again.
    tables = {folder.table(name) for name in TABLES}
    whole += [path for path in folder.derivatives.glob("*") if path not in tables]
    whole += [folder.quarantine / sha256[:16] for sha256 in aside]
    whole += _named(folder, code)
    _refuse_links(whole)
    count = 0
    for path in whole:
        if not path.exists():
            continue
        try:
            if path.is_dir():
                count += sum(one.is_file() for one in path.rglob("*"))
                shutil.rmtree(path)
            else:
                count += 1
                path.unlink()
        except OSError as error:
            raise RecordingError(
                f"{path.name} cannot be removed: {error.strerror}. Correct this and erase again; the command continues "
                "from here."
            ) from error
    return count, len(exports)


def _refuse_links(paths: list[Path]) -> None:
    """Refuse symbolic links: their targets are outside the study, and an erasure would silently leave them.

    Raises:
        RecordingError: A path is a symbolic link.
    """
    for path in paths:
        if path.is_symlink():
            raise RecordingError(
                f"{path} is a symbolic link to {path.readlink()}, outside the study. Nothing was removed. Remove its "
                "target by hand, then the link, and erase again."
            )


def _named(folder: StudyFolder, code: str) -> list[Path]:
    """Return all paths that contain the code in their name."""
    return [path for path in folder.path.rglob("*") if code.lower() in path.name.lower()]


def _strip_log(folder: StudyFolder, words: list[str]) -> int:
    """Remove the log lines that name the person; return their number."""
    if not folder.log.exists():
        return 0
    lines = folder.log.read_text(encoding="utf-8", errors="replace").splitlines(keepends=True)
    kept = [line for line in lines if not has_word(line, words)]
    write_whole(folder.log, "".join(kept))
    return len(lines) - len(kept)
