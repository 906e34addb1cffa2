"""Command `exograv study init`."""

from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Any

import tyro


@dataclass(frozen=True)
class Init:
    """Options of `exograv study init`."""

    study: Annotated[Path, tyro.conf.Positional] = field(default=tyro.MISSING)
    """Folder of the study, which is created."""

    name: str | None = None
    """Name of the study. Groups and sessions are those of the paper until you change `study.toml`."""


def run_init(command: Init) -> dict[str, Any]:
    """Create the folder of a study with a `study.toml` to fill in."""
    from exograv.study.dataset.beginning import begin_study
    from exograv.study.folder.settings import AS_PUBLISHED, StudySettings, checked

    told = {} if command.name is None else {"name": command.name}
    settings = checked(StudySettings, AS_PUBLISHED.model_dump() | told, "--name")
    folder = begin_study(command.study, settings)
    first = next(iter(settings.groups))
    print(f"{folder.path} is a study. Fill in {folder.path / 'study.toml'}, then add a participant:")
    print(f"  exograv study participant {folder.path} new --group {first} --consent v1")
    return {"study": str(folder.path), "groups": list(settings.groups)}
