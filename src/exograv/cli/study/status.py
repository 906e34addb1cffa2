"""`exograv study status`."""

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import tyro

if TYPE_CHECKING:
    from exograv.study.dataset.status import StudyStatus


@dataclass(frozen=True)
class Status:
    """Options of `exograv study status`."""

    study: Annotated[Path, tyro.conf.Positional] = Path()
    """Folder of the study; the one you are in if absent."""

    remake: bool = False
    """Make all tables anew from the sources."""


def run_status(command: Status) -> "StudyStatus":
    """What a study holds, and what is missing."""
    from exograv.study.dataset.status import study_status
    from exograv.study.folder.study_folder import StudyFolder

    from .showing import show_status

    status = study_status(StudyFolder(command.study), everything=command.remake)
    show_status(status)
    return status
