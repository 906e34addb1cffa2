"""Command `exograv arm weigh` and the table of its result."""

from typing import TYPE_CHECKING

from exograv.laboratory.options import WeighOptions

if TYPE_CHECKING:
    from exograv.laboratory.weighing_command import WeighResult


def run_weigh_command(options: WeighOptions) -> "WeighResult":
    """Check in twenty seconds if the arm fits the form; then weigh known weights in the hand and at the forearm."""
    from exograv.cli.shell.terminal import bars
    from exograv.laboratory.weighing_command import run_weighing

    with bars() as progress:
        result = run_weighing(options, progress)
    show_weighing(result)
    return result


def show_weighing(result: "WeighResult") -> None:
    """Print the verdict, then a table with one row per weight."""
    from rich.console import Console
    from rich.table import Table

    console = Console()
    verdict = "REFUSED. " if result.refused else ""
    console.print(verdict + result.why, highlight=False)
    if result.ci95_kg is not None:
        low, high = result.ci95_kg
        console.print(
            f"Arm: {result.arm_mass_kg:.2f} kg (95 %: {low:.2f} to {high:.2f}); true {result.true_arm_mass_kg:.2f} kg.",
            highlight=False,
        )
    if not result.weights:
        return
    run = result.run
    table = Table(title=f"{run.rig}, disturbance level {run.disturbance_level}, world {run.world}, seed {run.seed}")
    for heading in ("weight at the", "found, kg", "95 %, kg", "true, kg"):
        table.add_column(heading, justify="right")
    for row in result.weights:
        found, (low, high) = row.found, row.found.ci95_kg
        table.add_row(row.place, f"{found.estimated_kg:.3f}", f"{low:.3f} to {high:.3f}", f"{found.true_kg:.3f}")
    console.print(table)
