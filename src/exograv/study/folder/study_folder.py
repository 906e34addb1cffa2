"""Paths within a study's folder."""

from dataclasses import dataclass
from pathlib import Path


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
