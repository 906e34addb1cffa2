"""`exograv study status`."""

from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Any

import tyro

from exograv.cli.common import Common


@dataclass(frozen=True)
class Status(Common):
    """What a study holds, and what is missing."""

    study: Annotated[Path, tyro.conf.Positional] = field(default=tyro.MISSING)
    """Folder of the study."""


def run_status(command: Status) -> dict[str, Any]:
    """Say it."""
    raise NotImplementedError
