"""Journal of a study (`log.jsonl`), one line per event, without names of people, and the lock of the study's folder."""

import contextlib
import json
import os
from collections.abc import Iterator
from dataclasses import dataclass, fields
from datetime import UTC, datetime
from pathlib import Path

from exograv.errors import ConfigError, RecordingError
from exograv.files import append_rows

from .folder_lock import take_lock
from .study_folder import StudyFolder

LOCK = ".lock"
"""Lock file in a folder, which one process at a time may hold."""


@dataclass(frozen=True)
class JournalEntry:
    """Line of the journal."""

    at: str = ""
    what: str = ""
    """Kind of event: `added`, `refused`, `quarantined`, `replaced`, `erased` …"""

    sentence: str = ""
    """Description of the event for a reader."""

    sha256: str | None = None
    """Hash of the file that the event concerns."""


def note(folder: StudyFolder, what: str, sentence: str, **more: str | None) -> None:
    """Append a line to the journal and force it to the disk.

    Args:
        folder: Folder of the study.
        what: As in `JournalEntry`.
        sentence: As in `JournalEntry`.
        more: Further fields, such as `sha256` and `participant`.

    Raises:
        RecordingError: The disk is full, or the folder cannot be written.
    """
    entry = {"at": datetime.now(UTC).replace(microsecond=0).isoformat(), "what": what, "sentence": sentence, **more}
    try:
        append_rows(folder.log, [entry])
    except OSError as error:
        raise RecordingError(f"{folder.log} cannot be written: {error.strerror}. Free space on the disk.") from error


def read_journal(folder: StudyFolder) -> list[JournalEntry]:
    """Read all complete lines, in the order of writing."""
    try:
        lines = folder.log.read_text(encoding="utf-8", errors="replace").splitlines()
    except FileNotFoundError:
        return []
    entries = list[JournalEntry]()
    for line in lines:
        with contextlib.suppress(json.JSONDecodeError):
            told = json.loads(line)
            known = {one.name: told[one.name] for one in fields(JournalEntry) if one.name in told}
            entries.append(JournalEntry(**known))
    return entries


@contextlib.contextmanager
def alone(folder: StudyFolder) -> Iterator[None]:
    """Lock the study for this process. The lock of a killed command is released with its process.

    Raises:
        ConfigError: Another process holds the lock, or the folder cannot be written.
    """
    with locked(
        folder.path, f"Another exograv command is changing {folder.path}. Try again when that command has ended."
    ):
        yield


@contextlib.contextmanager
def locked(path: Path, busy: str, name: str = LOCK) -> Iterator[None]:
    """Lock a folder for this process by a file of that name in it; the lock ends with the process.

    Raises:
        ConfigError: Another process holds the lock (message `busy`), or the folder cannot be written.
    """
    try:
        handle = os.open(path / name, os.O_RDWR | os.O_CREAT, 0o600)
    except OSError as error:
        raise ConfigError(
            f"{path} cannot be written: {error.strerror}. Check the folder's owner and permissions."
        ) from error
    try:
        _take(handle, busy)
        yield
    finally:
        os.close(handle)


def _take(handle: int, busy: str) -> None:
    try:
        take_lock(handle)
    except BlockingIOError as error:
        raise ConfigError(busy) from error
