"""Command `exograv study status`."""

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
    """Folder of the study; by default the current folder."""

    remake: bool = False
    """Compute all tables again from the sources."""


def run_status(command: Status) -> "StudyStatus":
    """Show the content of a study, and its missing sessions."""
    from exograv.cli.shell.progress import FIRST_LINE_S, bars
    from exograv.study.dataset.status import study_status
    from exograv.study.folder.study_folder import StudyFolder

    from .showing import show_status

    with bars(FIRST_LINE_S) as progress:
        progress("Computing the tables of the study", 0.0)
        status = study_status(StudyFolder(command.study), everything=command.remake)
    show_status(status)
    return status
