"""Options of a participant's file."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

from exograv.options import Acts, Options, PersonCode

from .method_names import MethodName, refuse_without_uncertainty


@dataclass(frozen=True)
class ParticipantOptions(Options):
    """Files of a person that a run reads and writes."""

    keep: Path | None = None
    """File in which the person as identified is kept for the next donning."""

    code: Annotated[str | None, PersonCode(), Acts(lambda all_: all_.keep is not None, "with --keep")] = None
    """Code of the person in that file, such as P-07, never a name; a random code if none is given."""

    participant: Path | None = None
    """File of an earlier donning (`--keep`) to start from."""

    @classmethod
    def of_file(cls, file: Path, code: str) -> "ParticipantOptions":
        """Return the options of a session: it starts from the person's file if there is one, and writes it."""
        return cls(keep=file, code=code, participant=file if file.exists() else None)

    def refuse_method(self, method: MethodName) -> None:
        """Check before a run that a method's estimate can be kept, or continued from a file.

        Raises:
            ConfigError: The method states no uncertainty.
        """
        for option, file in (("--keep", self.keep), ("--participant", self.participant)):
            if file is not None:
                refuse_without_uncertainty(option, method)


NO_FILES = ParticipantOptions()
