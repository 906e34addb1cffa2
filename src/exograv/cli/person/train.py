"""Command `exograv run train` and the printout of its result."""

import sys
from typing import TYPE_CHECKING

from exograv.cli.shell.base_options import OutFolder, refuse_unwritable
from exograv.experiment.train.options import TrainOptions

if TYPE_CHECKING:
    from exograv.experiment.train.train_command import TrainResult


def run_train_command(options: TrainOptions, common: OutFolder) -> "TrainResult":
    """Simulate a session of a protocol: a virtual participant in the twin touches a target, window after window.

    A session with a person is run at the console: exograv run console --protocol NAME (docs/howto/console.md).
    """
    from exograv.cli.shell.terminal import bars
    from exograv.experiment.train.train_command import how_to_go_on, run_training

    if options.person_file is not None:
        refuse_unwritable(options.person_file, "--person-file")
    try:
        with bars() as progress:
            result = run_training(options, common.out, progress)
    except KeyboardInterrupt:
        print(f"\n{how_to_go_on(options, common.out)}", file=sys.stderr)
        raise
    show_training(result)
    return result


def show_training(result: "TrainResult") -> None:
    """Print deviations, counts of touches, and the path of the report."""
    from rich.console import Console
    from rich.table import Table

    touched = result.touched
    table = Table(title=f"{result.protocol}, participant {result.participant}, session {result.session}")
    for heading in ("", "median", "quarter below", "quarter above"):
        table.add_column(heading, justify="right" if heading else "left")
    for unit, found in (("px", touched.deviation_px), ("mm", touched.deviation_mm)):
        values = (found.median, found.q1, found.q3)
        table.add_row(f"deviation, {unit}", *("-" if value is None else f"{value:.1f}" for value in values))
    console = Console()
    console.print(table)
    rejected = ", ".join(f"{count} {reason}" for reason, count in touched.rejected.items()) or "none"
    per_window = touched.touches_per_window.median
    lines = [
        f"{touched.windows} windows, {touched.accepted} of {touched.touches} touches counted "
        f"(rejected: {rejected}); median {'no' if per_window is None else f'{per_window:g}'} touches per window.",
        f"{result.simulated_s:.0f} s simulated in {result.wall_s:.0f} s; {result.recording_MB:g} MB.",
    ]
    if not result.is_whole_protocol:
        lines.insert(0, "Only a part of the protocol was run (--windows).")
    for line in lines:
        console.print(line, highlight=False)
    console.print(f"Report: {result.report}", highlight=False, soft_wrap=True)
