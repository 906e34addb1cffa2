"""Command `exograv next` and its checklist."""

from typing import TYPE_CHECKING

from exograv.cli.shell.base_options import OutFolder
from exograv.live.options import NextOptions

if TYPE_CHECKING:
    from exograv.live.on_drives.next_step import NextStep


def run_next_command(options: NextOptions, common: OutFolder) -> "NextStep":
    """Show what a machine on drives, a person and a session have passed so far, and the one command to run now."""
    from exograv.live.on_drives.next_step import next_step

    result = next_step(options, common.out)
    show_next(result)
    return result


def show_next(result: "NextStep") -> None:
    """Print a line for each check, and the command to run now."""
    from exograv.cli.shell.terminal import say, say_unbroken

    say(f"{result.rig}, {result.side}, serial {result.serial}")
    for check in result.checks:
        say(check.line)
    say_unbroken(f"Run now: {result.command}")
