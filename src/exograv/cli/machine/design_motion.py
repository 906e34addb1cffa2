"""Command `exograv rig motion` and the table of its result."""

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from exograv.cli.shell.base_options import OutFolder, refuse_unwritable
from exograv.procedures.machine_tools.options import DesignOptions

if TYPE_CHECKING:
    from exograv.procedures.machine_tools.design_motion import DesignFigures


def run_design_motion(options: DesignOptions, common: OutFolder) -> "DesignFigures":
    """Design the most informative motion for an arm in a machine, and print the block for its rig.toml."""
    from exograv.cli.shell.terminal import bars
    from exograv.identification.excitation.basis import excitation_text
    from exograv.model.description import rig_folder
    from exograv.procedures.machine_tools.design_motion import design_motion, write_excitation
    from exograv.report.figures.excitation import draw
    from exograv.report.style.figure_style import write_picture

    refuse_unwritable(common.out / "motion.svg", "--out")
    with bars() as progress:
        designed = design_motion(options, progress)
    result, path = designed.figures, designed.path
    joints, picture_path = result.joints, common.out / "motion.svg"
    picture = write_picture(picture_path, lambda: draw(joints, path.q, path.dt, designed.limits_deg))
    print(excitation_text(result.excitation))
    show_design(result)
    if result.is_interrupted:
        begun = f"{result.starts} of {options.starts + 1} starts"
        print(
            f"Ctrl-C ended the search after {begun}. The motion above is the best until then; more starts may find a "
            "better one."
        )
    print(f"Picture of one period: {picture}")
    if options.write:
        write_excitation(rig_folder(options.rig) / "rig.toml", result.excitation)
        print(f"Next: the block is in rig.toml. Run `exograv rig check {options.rig}`.")
    elif Path(options.rig).is_dir():
        print(
            f"Next: put the block above into {Path(options.rig) / 'rig.toml'} in place of its [excitation], then run "
            f"`exograv rig check {options.rig}`."
        )
    return replace(result, picture=picture)


def show_design(result: "DesignFigures") -> None:
    """Print the predicted left over per joint and its target, by motion and time."""
    from rich.console import Console
    from rich.table import Table

    table = Table(title=f"{result.rig}: predicted left over, N·m at each joint")
    table.add_column("motion")
    times = list(result.predicted_left_over_Nm["designed"])
    for t in times:
        table.add_column(f"after {t} s", justify="right")
    for name, predicted in result.predicted_left_over_Nm.items():
        table.add_row(name, *(" ".join(f"{value:.2f}" for value in predicted[t]) for t in times))
    table.add_row("target", *(" ".join(f"{value:.2f}" for value in result.targets_Nm) for _ in times))
    Console().print(table)
