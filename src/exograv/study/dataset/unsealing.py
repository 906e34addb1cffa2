"""Unsealing: sealed groups are opened with the allocation list that was drawn before the study."""

from pathlib import Path

from pydantic import ValidationError

from exograv.errors import ConfigError
from exograv.study.folder.settings import read_settings
from exograv.study.folder.study_folder import StudyFolder
from exograv.study.participants.participant_record import SEALED
from exograv.study.participants.register import read_register, write_register
from exograv.task.allocation import AllocationList, group_of


def unseal(folder: StudyFolder, path: Path) -> list[str]:
    """Give each sealed participant the group of the allocation list; return their codes.

    Raises:
        ConfigError: The list cannot be read, was edited or lacks a participant, or has a group that the study does not.
        RecordingError: The folder cannot be written.
    """
    try:
        allocation = AllocationList.model_validate_json(path.read_bytes())
    except OSError as error:
        raise ConfigError(
            f"--allocation {path} cannot be read: {error.strerror}. Give the study's allocation list."
        ) from error
    except ValidationError:
        raise ConfigError(
            f"--allocation {path} is not an allocation list. Give the list that was drawn for the study."
        ) from None
    groups, rows = read_settings(folder).groups, read_register(folder)
    opened = {row.code: group_of(allocation, row.code).name for row in rows if row.group == SEALED}
    if strange := sorted(set(opened.values()) - set(groups)):
        raise ConfigError(
            f"The list has group {', '.join(strange)}, which is not in study.toml. Groups there: {', '.join(groups)}."
        )
    write_register(folder, [row.model_copy(update={"group": opened.get(row.code, row.group)}) for row in rows])
    return list(opened)
