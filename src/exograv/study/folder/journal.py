"""`log.jsonl`: what happened to a study, a line each, without anybody's name; and one hand at a time."""

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
"""File of a folder that one process at a time may hold."""


@dataclass(frozen=True)
class JournalEntry:
    """One line."""

    at: str = ""
    what: str = ""
    """`added`, `refused`, `quarantined`, `replaced`, `erased` …"""

    sentence: str = ""
    """For a person to read."""

    sha256: str | None = None
    """Hash of the file."""


def note(folder: StudyFolder, what: str, sentence: str, **more: str | None) -> None:
    """Append a line and force it to the disk.

    Args:
        folder: The study's.
        what: As in `JournalEntry`.
        sentence: As in `JournalEntry`.
        more: Such as `sha256` and `participant`.

    Raises:
        RecordingError: The disk is full, or the folder cannot be written.
    """
    entry = {"at": datetime.now(UTC).replace(microsecond=0).isoformat(), "what": what, "sentence": sentence, **more}
    try:
        append_rows(folder.log, [entry])
    except OSError as error:
        raise RecordingError(f"{folder.log} cannot be written: {error.strerror}. Free space on the disk.") from error


def read_journal(folder: StudyFolder) -> list[JournalEntry]:
    """Read all whole lines, in the order of writing."""
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
    """Nobody else changes the study meanwhile; a killed command lets go by itself.

    Raises:
        ConfigError: Somebody does, or the folder cannot be written.
    """
    with locked(folder.path, f"Another exograv command is changing {folder.path}. Try again when it has ended."):
        yield


@contextlib.contextmanager
def locked(path: Path, busy: str) -> Iterator[None]:
    """One process at a time holds a folder; the lock dies with its process.

    Raises:
        ConfigError: Another one holds it, which `busy` says, or the folder cannot be written.
    """
    try:
        handle = os.open(path / LOCK, os.O_RDWR | os.O_CREAT, 0o600)
    except OSError as error:
        raise ConfigError(f"{path} cannot be written: {error.strerror}. Check whose folder it is.") from error
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
