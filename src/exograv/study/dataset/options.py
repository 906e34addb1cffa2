"""Options of files that come into a study."""

from dataclasses import dataclass
from pathlib import Path

import tyro


@dataclass(frozen=True)
class AddOptions:
    """Options of `exograv study add`: what is told beside the files. Where a file says another, it is followed."""

    participant: str | None = None
    """Code, where the files do not say it."""

    protocol: str | None = None
    """Its name, where the files do not say it."""

    session: int | None = None
    """Which one of this protocol it is, where the files do not say it."""

    acquired: str | None = None
    """Date and time, ISO 8601: recordings hold none."""

    new_code: tyro.conf.UseAppendAction[tuple[str, ...]] = ()
    """OLD=CODE, for files that were made under another code; once for each."""

    gravity_level: float | None = None
    """Felt share of the arm's weight, for touches that say none."""

    mapping: Path | None = None
    """TOML file that says where touches are in XDF of somebody else."""

    replace: bool = False
    """A session that is there already is put aside in quarantine."""
