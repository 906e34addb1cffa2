"""Options of a participant's file."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

from exograv.options import Acts, Options, PersonCode


@dataclass(frozen=True)
class ParticipantOptions(Options):
    """Files of a person that a run reads and writes."""

    keep: Path | None = None
    """File in which the person as identified is kept for the next donning."""

    code: Annotated[str | None, PersonCode(), Acts(lambda all_: all_.keep is not None, "with --keep")] = None
    """Code of the person in that file, such as P-07, never a name; a random code if none is given."""

    participant: Path | None = None
    """File of an earlier donning (`--keep`) to start from."""


NO_FILES = ParticipantOptions()
