"""Command `exograv rig test` and the table of its result."""

from typing import TYPE_CHECKING

from exograv.cli.shell.base_options import OutFolder
from exograv.live.options import RigTestOptions
from exograv.next_command import same_machine

if TYPE_CHECKING:
    from exograv.live.on_drives.bring_up_command import BringUpResult


def run_rig_test_command(options: RigTestOptions, common: OutFolder) -> "BringUpResult":
    """Bring up an empty machine on the bench, step by step in order of danger. No step can be skipped."""
    from exograv.cli.shell.terminal import bars, say
    from exograv.live.on_drives.bring_up_command import run_rig_test

    with bars() as progress:
        result = run_rig_test(options, common.out, progress, say)
    show_rig_test(result)
    if result.passed:
        say(f"Next: {same_machine('rig calibrate', options, common.out)}")
    return result


def show_rig_test(result: "BringUpResult") -> None:
    """Print a table with one row per step, the verdict, and a line for a signature."""
    from exograv.cli.shell.terminal import say, say_unbroken, show_steps

    simulated = ", simulated" if result.simulated else ""
    title = f"Bring-up of {result.rig}, serial {result.serial}{simulated}"
    show_steps(title, [(step.name.replace("_", " "), step) for step in result.steps])
    verdict = (
        "The machine has passed."
        if result.passed
        else "The machine has not passed: correct the failed step and repeat."
    )
    say(f"{verdict} Done by: {result.by or '–'}    Signature: ______________________")
    say_unbroken(f"{result.sheet} (sealed {result.sha256[:12]}…)")
