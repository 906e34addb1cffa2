"""Paths in a study's folder."""

from dataclasses import dataclass
from pathlib import Path

UNFINISHED = (
    "This study is unfinished: the command that makes it was interrupted, or it still runs. Run the same command "
    "again; it continues with the missing sessions."
)


@dataclass(frozen=True)
class StudyFolder:
    """Paths in a study's folder."""

    path: Path

    @property
    def unfinished(self) -> Path:
        """Path of the checkpoint of a command that makes a whole study. The file exists until the study is complete."""
        return self.path / "unfinished.json"

    @property
    def is_unfinished(self) -> bool:
        """True if the command that makes this study has not come to its end."""
        return self.unfinished.exists()

    @property
    def settings(self) -> Path:
        """Path of the file with name, groups and expected sessions."""
        return self.path / "study.toml"

    @property
    def participants(self) -> Path:
        """Path of the file with codes and participants' data; `derivatives/participants.parquet` is made from it."""
        return self.path / "participants.toml"

    @property
    def log(self) -> Path:
        """Path of the log of added, refused, quarantined and erased files: one JSON object per line."""
        return self.path / "log.jsonl"

    @property
    def sources(self) -> Path:
        """Folder of the raw files, byte for byte: `<code>/<protocol>-<session>/`."""
        return self.path / "sourcedata"

    @property
    def quarantine(self) -> Path:
        """Folder of the files that could not be read or were replaced."""
        return self.path / "quarantine"

    @property
    def derivatives(self) -> Path:
        """Folder of the tables that are made from the sources."""
        return self.path / "derivatives"

    @property
    def report(self) -> Path:
        """Folder of pages and figures."""
        return self.path / "report"

    def session(self, participant: str, protocol: str, session: int) -> Path:
        """Folder of the raw files of one session."""
        return self.sources / participant / f"{protocol}-{session:02d}"

    def table(self, name: str) -> Path:
        """Path of a table of `columns.TABLES`."""
        return self.derivatives / f"{name}.parquet"

    def source(self, relative: str) -> Path:
        """Path of a source, from its path in `sessions.source`."""
        return self.path / relative
