"""Register of the participants by code (`participants.toml`)."""

from collections.abc import Sequence

from pydantic import Field, model_validator

from exograv.errors import ConfigError
from exograv.files import toml_text, write_whole
from exograv.model.rig_settings import Settings
from exograv.study.folder.settings import VERSION, checked, read_settings, read_toml
from exograv.study.folder.study_folder import StudyFolder

from .codes import draw_code, typed_code
from .participant_record import SEALED, ParticipantRow

HEAD = "# Participants by code. Their names are in a separate encrypted file (docs/howto/study.md).\n"


class Register(Settings):
    """Content of the file `participants.toml`."""

    schema_version: int = VERSION
    participants: list[ParticipantRow] = Field(default=[])

    @model_validator(mode="after")
    def _each_once(self) -> "Register":
        codes = [one.code for one in self.participants]
        if twice := sorted({code for code in codes if codes.count(code) > 1}):
            raise ValueError(f"two participants have the same code: {', '.join(twice)}")
        return self


def read_register(folder: StudyFolder) -> tuple[ParticipantRow, ...]:
    """Read all participants, in the order in which they were added.

    Raises:
        ConfigError: The file cannot be used, or names a group that the study does not have.
    """
    if not folder.participants.is_file():
        return ()
    rows = tuple(read_toml(folder.participants, Register).participants)
    groups = {SEALED, *read_settings(folder).groups}
    if strange := [row.code for row in rows if row.group not in groups]:
        raise ConfigError(
            f"{folder.participants}: {', '.join(strange)} has a group that is not in study.toml. "
            f"Groups there: {', '.join(sorted(groups))}."
        )
    return rows


def write_register(folder: StudyFolder, rows: Sequence[ParticipantRow]) -> None:
    """Write all participants, completely or not at all.

    Raises:
        RecordingError: The folder cannot be written.
    """
    register = {"schema_version": VERSION, "participants": [row.model_dump(exclude_none=True) for row in rows]}
    write_whole(folder.participants, toml_text(register, HEAD))


def new_participant(folder: StudyFolder, group: str, code: str | None = None, **told: str | None) -> ParticipantRow:
    """Add a participant.

    Args:
        folder: Folder of the study.
        group: Group of the study, or `sealed`.
        code: Code of an allocation that was drawn before. Without it a new code is drawn.
        told: Further fields of `ParticipantRow`.

    Raises:
        ConfigError: There is no such group, the code is taken, or the text is not a code.
        RecordingError: The folder cannot be written.
    """
    groups, rows = read_settings(folder).groups, read_register(folder)
    if group != SEALED and group not in groups:
        raise ConfigError(f"The study has no such group. Give one of its groups, {', '.join(groups)}, or '{SEALED}'.")
    taken = {row.code for row in rows}
    code = draw_code(taken) if code is None else typed_code(code)
    if code in taken:
        raise ConfigError(f"Participant {code} exists already: two people with the same code cannot be distinguished.")
    row = checked(ParticipantRow, {"code": code, "group": group, **told}, "The data of the participant")
    write_register(folder, (*rows, row))
    return row
