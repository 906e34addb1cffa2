"""Command `exograv study example`."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

from exograv.campaigns.study_example.options import ExampleOptions


@dataclass(frozen=True)
class NewStudy:
    """Folder of the example."""

    out: Path = Path("study")
    """Folder of the study, which is created."""


def run_example(options: ExampleOptions, new: NewStudy) -> dict[str, Any]:
    """Create a complete example study with simulated participants. Every page says that it is simulated."""
    from exograv.campaigns.study_example.example_study import make_example
    from exograv.cli.shell.terminal import bars

    with bars() as progress:
        folder = make_example(options, new.out, progress)
    print(f"{folder.path} is a study with simulated participants: exograv study report {folder.path}")
    return {"dataset": str(folder.path)}
