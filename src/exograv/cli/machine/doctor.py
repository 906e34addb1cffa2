"""`exograv doctor`."""

from dataclasses import dataclass
from typing import Any

from exograv.cli.shell.base_options import Common


@dataclass(frozen=True)
class Doctor:
    """Options of `exograv doctor`."""

    loop: float | None = None
    """Also run the live loop for so long [s], half of it with real-time rights: may a worn machine hang on it?"""


def run_doctor(command: Doctor, common: Common) -> dict[str, Any]:
    """Say whether this computer has what exograv needs, and how fast its loop is here."""
    from exograv.cli.shell.terminal import bars, show_doctor, show_loop
    from exograv.procedures.self_test.loop_timing import loop_test, refuse_unusable

    from .computer_check import examine_computer, has_all_it_needs

    if command.loop is not None:
        refuse_unusable(command.loop)
    result = examine_computer(common.out)
    show_doctor(result)
    if command.loop is not None and has_all_it_needs(result):
        with bars() as progress:
            result["loop"] = loop_test(command.loop, progress)
        show_loop(result["loop"])
    return result
