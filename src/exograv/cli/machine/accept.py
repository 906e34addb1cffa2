"""Command `exograv rig accept` and the table of its result."""

from typing import TYPE_CHECKING

from exograv.cli.shell.base_options import OutFolder, refuse_unwritable
from exograv.live.options import AcceptOptions
from exograv.next_command import same_machine

if TYPE_CHECKING:
    from exograv.live.on_drives.acceptance_command import AcceptanceResult


def run_accept_command(options: AcceptOptions, common: OutFolder) -> "AcceptanceResult":
    """Accept a machine with a dummy arm of known masses before the first person: identify, float, weigh, stop it."""
    from exograv.cli.shell.terminal import bars, say
    from exograv.live.on_drives.acceptance_command import run_acceptance

    refuse_unwritable(common.out / "acceptance" / "identify" / "live.mcap", "--out")
    if options.simulate:
        say("SIMULATED: machine and dummy exist in a simulation only.")
    with bars() as progress:
        result = run_acceptance(options, common.out, progress, say)
    show_acceptance(result)
    if result.ok:
        test = same_machine("rig self-test", options, common.out)
        say(f"The stops on purpose have locked the machine. Before the first person: `{test}`.")
    return result


def show_acceptance(result: "AcceptanceResult") -> None:
    """Print a table with one row per step, the verdict, and a line for a signature."""
    from rich.console import Console
    from rich.table import Table

    from exograv.cli.shell.terminal import say, say_unbroken

    simulated = ", SIMULATED" if result.simulated else ""
    table = Table(title=f"Acceptance of {result.rig}, serial {result.serial}{simulated}")
    for heading in ("step", "measured", "limit", ""):
        is_figure = heading in ("measured", "limit")
        table.add_column(heading, justify="right" if is_figure else "left", overflow="fold")
    for part in result.parts:
        kept = ", kept" if part.name in result.kept else ""
        table.add_row(f"{part.name}{kept}", "", "", "ok" if part.passed else "FAILED", style="bold")
        for step in part.steps:
            table.add_row(step.name.replace("_", " "), step.measured, step.limit, "ok" if step.passed else "FAILED")
    Console().print(table)
    for part in result.parts:
        for step in part.steps:
            if step.what_to_do:
                say(f"{step.name}: {step.what_to_do}")
    verdict = "The machine is accepted." if result.ok else "The machine is not accepted: correct the failed part."
    say(f"{verdict} Done by: {result.by or '–'}    Signature: ______________________")
    say_unbroken(f"{result.page}, sealed in {result.protocol} ({result.sha256[:12]}…)")
