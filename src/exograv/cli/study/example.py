"""`exograv study example`."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

import tyro

from exograv.cli.shell.base_options import Common, whole_pair


@dataclass(frozen=True)
class Example(Common):
    """A complete study with nobody in it, to see what the others do; every page says that it is simulated."""

    out: Path = Path("study")
    """Folder of the study, which is made."""

    participants: Annotated[str, tyro.conf.arg(metavar="A,B")] = "3,3"
    """Trained and untrained."""

    sessions: Annotated[str, tyro.conf.arg(metavar="A,B")] = "16,4"
    """Of each before the flight."""


def run_example(command: Example) -> dict[str, Any]:
    """Make it."""
    from exograv.campaigns.study_example.example_study import ExampleOptions, make_example
    from exograv.cli.shell.terminal import bars

    options = ExampleOptions(
        whole_pair(command.participants, "--participants"), whole_pair(command.sessions, "--sessions"), command.seed
    )
    with bars() as progress:
        folder = make_example(options, command.out, progress)
    print(f"{folder.path} is a study with simulated participants: exograv study report {folder.path}")
    return {"dataset": str(folder.path)}
