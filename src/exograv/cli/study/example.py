"""Command `exograv study example`."""

import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from exograv.campaigns.study_example.options import ExampleOptions


@dataclass(frozen=True)
class NewStudy:
    """Folder of the example."""

    out: Path = Path("study")
    """Folder of the study, which is created. The same command continues an interrupted study."""


def run_example(options: ExampleOptions, new: NewStudy) -> dict[str, Any]:
    """Create a complete example study with simulated participants, or continue an interrupted one.

    Every page says that it is simulated.
    """
    from exograv.campaigns.study_example.example_study import make_example
    from exograv.cli.shell.terminal import bars
    from exograv.study.folder.study_folder import UNFINISHED, StudyFolder

    try:
        with bars() as progress:
            folder = make_example(options, new.out, progress)
    except KeyboardInterrupt:
        if StudyFolder(new.out).is_unfinished:
            print(f"\n{UNFINISHED}", file=sys.stderr)
        raise
    print(f"{folder.path} is a study with simulated participants: exograv study report {folder.path}")
    return {"dataset": str(folder.path)}
