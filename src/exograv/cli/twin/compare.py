"""Command `exograv twin compare` and the table of its result."""

from typing import TYPE_CHECKING

from exograv.cli.shell.base_options import Common
from exograv.procedures.machine_twin.options import TwinCompareOptions

if TYPE_CHECKING:
    from exograv.laboratory.twin_comparison import TwinComparison


def run_twin_compare(options: TwinCompareOptions, common: Common) -> "TwinComparison":
    """Replay a recording of an empty machine on its fitted twin, and show where they depart, joint by joint."""
    from exograv.cli.shell.terminal import bars
    from exograv.laboratory.twin_comparison import compare_twin

    with bars() as progress:
        result = compare_twin(options, progress)
    show_comparison(result)
    return result


def show_comparison(result: "TwinComparison") -> None:
    """Print the departures per joint in N·m and degrees."""
    from rich.console import Console
    from rich.table import Table

    from exograv.cli.shell.terminal import say

    table = Table(title=f"Departure of the twin in {result.replayed_s:.0f} s, RMS")
    table.add_column("joint")
    for heading in (
        "torque\nN·m",
        "at the fit\nN·m",
        "feedback\nN·m",
        "path with\nfeedback °",
        "path, 0.5 s\nwithout °",
        "per tick\nover noise",
    ):
        table.add_column(heading, justify="right")
    for row in result.joints:
        values = (row.torque_Nm, row.fitted_Nm, row.feedback_Nm, row.closed_loop_deg, row.open_loop_deg)
        cells = [f"{value:.2g}" for value in values]
        table.add_row(row.joint.replace("_", "\n"), *cells, f"{row.over_noise:.2f}")
    Console().print(table)
    say(
        "Torque: what the twin's parameters leave unexplained below 7 Hz. Feedback: what keeps the twin on the "
        "recorded path under the recorded commands. Path: distance of the twin from it."
    )
    if result.ok:
        say(f"No joint's torque departs by more than {result.allowed:g} times that at the fit.")
    else:
        say(
            f"The torque of {', '.join(result.departed)} departs by more than {result.allowed:g} times that at the "
            "fit. The machine has changed, a weight hangs that is not stated, the recording has other units or signs, "
            "or the twin is of another machine."
        )
