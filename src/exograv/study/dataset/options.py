"""Options of `exograv study add`."""

from dataclasses import dataclass
from pathlib import Path

import tyro


@dataclass(frozen=True)
class AddOptions:
    """Options of `exograv study add`. A protocol or session given here overrides the one in a recording or XDF file."""

    participant: str | None = None
    """Code of the participant, if the files do not state it."""

    protocol: str | None = None
    """Name of the protocol, if the files do not state it."""

    session: int | None = None
    """Number of the session in this protocol, if the files do not state it."""

    acquired: str | None = None
    """Date and time of the recording, ISO 8601; recordings themselves hold none."""

    new_code: tyro.conf.UseAppendAction[tuple[str, ...]] = ()
    """OLD=CODE for files that were made under another code; may be given several times."""

    gravity_level: float | None = None
    """Felt share of the arm's weight, for touches without one: 0 weightless, 1 Earth."""

    mapping: Path | None = None
    """TOML file that maps channels of an XDF file from other software to columns of touches."""

    replace: bool = False
    """Replace a session that exists already; the old file is moved to quarantine."""
