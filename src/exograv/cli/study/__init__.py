"""Commands `exograv study …`: from a folder of recordings to findings. Each file has one command."""

from exograv.cli.shell.command import Action

from .add import run_add
from .example import run_example
from .export import run_export
from .identity import run_identity
from .init import run_init
from .participant import run_participant
from .power import run_power
from .report import run_study_report
from .status import run_status

COMMANDS: dict[str, Action] = {
    "init": run_init,
    "participant": run_participant,
    "identity": run_identity,
    "add": run_add,
    "status": run_status,
    "report": run_study_report,
    "power": run_power,
    "export": run_export,
    "example": run_example,
}
"""Commands by the word after `exograv study`."""
