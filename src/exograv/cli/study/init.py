"""`exograv study init`."""

from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Any

import tyro

from exograv.cli.common import Common


@dataclass(frozen=True)
class Init(Common):
    """Begin a study."""

    study: Annotated[Path, tyro.conf.Positional] = field(default=tyro.MISSING)
    """Its folder, which is made."""


def run_init(command: Init) -> dict[str, Any]:
    """Say it."""
    raise NotImplementedError
