"""Where everything of a study is, and how a file gets there: at once or not at all."""

import os
import secrets
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from exograv.errors import RecordingError

PARTIAL = ".partial-"
"""What the name of an unfinished file begins with; whoever is killed leaves it behind, and nobody reads it."""


@dataclass(frozen=True)
class StudyFolder:
    """Paths within a study's folder."""

    path: Path

    @property
    def settings(self) -> Path:
        """Name, groups, sessions that are expected."""
        return self.path / "study.toml"

    @property
    def participants(self) -> Path:
        """Codes and what is told of each; `derivatives/participants.parquet` is made from it."""
        return self.path / "participants.toml"

    @property
    def log(self) -> Path:
        """What was added, refused, quarantined, erased: one JSON object a line."""
        return self.path / "log.jsonl"

    @property
    def sources(self) -> Path:
        """Raw files, byte for byte: `<code>/<protocol>-<session>/`."""
        return self.path / "sourcedata"

    @property
    def quarantine(self) -> Path:
        """What could not be read, or was replaced."""
        return self.path / "quarantine"

    @property
    def derivatives(self) -> Path:
        """What is made from the sources."""
        return self.path / "derivatives"

    @property
    def report(self) -> Path:
        """Pages and figures."""
        return self.path / "report"

    def session(self, participant: str, protocol: str, session: int) -> Path:
        """Folder of the raw files of one session."""
        return self.sources / participant / f"{protocol}-{session:02d}"

    def table(self, name: str) -> Path:
        """Of `columns.TABLES`."""
        return self.derivatives / f"{name}.parquet"

    def source(self, relative: str) -> Path:
        """A path as `sessions.source` has it."""
        return self.path / relative


def written_whole(path: Path, write: Callable[[Path], None]) -> None:
    """Let `write` fill a file of another name, force it to the disk, and give it its own name.

    Raises:
        RecordingError: The disk is full, or the folder cannot be written.
    """
    partial = path.with_name(f"{PARTIAL}{secrets.token_hex(4)}-{path.name}")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        write(partial)
        sync(partial)
        partial.replace(path)
        sync(path.parent)
    except OSError as error:
        partial.unlink(missing_ok=True)
        raise RecordingError(
            f"{path} cannot be written: {error.strerror}. What was there is unchanged. Free space, or give a folder "
            "that you may write."
        ) from error


def write_text_whole(path: Path, text: str) -> None:
    """Write a text at once or not at all.

    Raises:
        RecordingError: The disk is full, or the folder cannot be written.
    """
    written_whole(path, lambda partial: _write(partial, text))


def _write(path: Path, text: str) -> None:
    path.write_text(text, encoding="utf-8")


def sync(path: Path) -> None:
    """Force a file, or the names in a folder, to the disk."""
    handle = os.open(path, os.O_RDONLY)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)
