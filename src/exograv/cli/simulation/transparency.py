"""Command `exograv dev transparency` and the table of its result."""

from typing import TYPE_CHECKING

from exograv.cli.shell.base_options import OutFolder
from exograv.cli.shell.motion_note import say_twin
from exograv.laboratory.options import TransparencyOptions

if TYPE_CHECKING:
    from exograv.laboratory.transparency import TransparencyResult
    from exograv.report.figures.transparency_data import MachineTransparency


def run_transparency_command(options: TransparencyOptions, common: OutFolder) -> "TransparencyResult":
    """Compare the muscle effort of one movement in six conditions, over several machines."""
    from exograv.cli.shell.terminal import bars
    from exograv.laboratory.transparency import run_transparency

    say_twin(options.twin)
    with bars() as progress:
        result = run_transparency(options, common.out, progress)
    for one in (*(result.profiles or {}).values(), *filter(None, [result.machine])):
        _show(one)
    print(f"Report: {result.report}")
    return result


def _show(result: "MachineTransparency") -> None:
    from rich.console import Console
    from rich.table import Table

    table = Table(
        title=f"{result.rig}, {result.movement}, disturbance level {result.disturbance_level}, median of "
        f"{len(result.seeds)}"
    )
    table.add_column("effort, N·m·s")
    for column in ("all", *(joint.replace("_", "\n") for joint in result.joints), "path\nerror °"):
        table.add_column(column, justify="right")
    for name, row in result.conditions.items():
        values = [row.effort_Nms, *row.by_joint_Nms]
        table.add_row(name.replace("_", " "), *(f"{value:.0f}" for value in values), f"{row.tracking_error_deg:.2f}")
    console = Console()
    console.print(table)
    ratios = result.dam_over_gcm
    console.print(
        f"With the arm carried too, {100 * ratios.effort:.0f} % of the effort remains (elbow alone "
        f"{100 * ratios.elbow:.0f} %); the true parameters would save {result.dam_minus_ideal_Nms:.1f} N·m·s.",
        highlight=False,
    )
    for stray in result.off_path:
        console.print(
            f"Path not followed: {stray.condition}, seed {stray.seed}, {stray.tracking_error_deg:.1f}°.",
            highlight=False,
        )
