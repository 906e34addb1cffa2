"""`exograv study …`: from a folder of recordings to findings. One file per word, imported when its command runs."""

from collections.abc import Callable
from typing import Any

from exograv.cli.shell.base_options import Common

from .add import Add, run_add
from .example import Example, run_example
from .export import Export, run_export
from .identity import Identity, run_identity
from .init import Init, run_init
from .participant import Participant, run_participant
from .power import Power, run_power
from .report import StudyReport, run_study_report
from .status import Status, run_status

COMMANDS: dict[str, tuple[type[Common], Callable[[Any], dict[str, Any]]]] = {
    "init": (Init, run_init),
    "participant": (Participant, run_participant),
    "identity": (Identity, run_identity),
    "add": (Add, run_add),
    "status": (Status, run_status),
    "report": (StudyReport, run_study_report),
    "power": (Power, run_power),
    "export": (Export, run_export),
    "example": (Example, run_example),
}
"""Word after `exograv study`."""
