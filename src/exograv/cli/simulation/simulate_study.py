"""Command `exograv study simulate` and the table of its result."""

from pathlib import Path
from typing import TYPE_CHECKING

from exograv.campaigns.virtual_study.options import StudyOptions, WorkOptions
from exograv.cli.shell.base_options import OutFolder, write_json
from exograv.results import json_value

if TYPE_CHECKING:
    from exograv.campaigns.virtual_study.study import VirtualStudyResult


def run_simulate_study(options: StudyOptions, work: WorkOptions, common: OutFolder) -> "VirtualStudyResult":
    """Simulate a study on the benefit of training for flight, with virtual participants. No evidence about people."""
    from exograv.campaigns.virtual_study.study import StudyComputation, simulate_study
    from exograv.cli.shell.terminal import bars

    folder = common.out / f"simulated_study_{options.seed}" if common.out == Path("out") else common.out
    print(f"The study is written to {folder}. Ctrl-C keeps finished participants; --resume continues.")

    def keep(result: "VirtualStudyResult") -> None:
        if common.json is not None:
            write_json(common.json, json_value(result))

    with bars() as progress:
        result = simulate_study(options, StudyComputation(**vars(work), folder=folder), progress, keep)
    show_study(result)
    return result


def show_study(result: "VirtualStudyResult") -> None:
    """Print a table of all conditions, and the two groups."""
    from rich.console import Console
    from rich.table import Table

    table = Table(title="Simulated: nobody took part")
    for heading in ("after", "people", "median in flight, px", "left over, N·m", "first window, mm up", "transfer"):
        table.add_column(heading, justify="left" if heading == "after" else "right")
    for name, one in result.outcome.conditions.items():
        interval = one.ci95
        transfer = _number(one.transfer, 2)
        if interval:
            transfer += f" ({_number(interval[0], 2)} to {_number(interval[1], 2)})"
        table.add_row(
            name, str(one.people), _number(one.median_px, 1), _number(one.left_over_Nm, 2),
            _number(one.first_window_up_mm, 1), transfer,
        )  # fmt: skip
    console = Console()
    console.print(table)
    for group, one in result.outcome.groups.items():
        console.print(f"{group}: {one.people} people, median {_number(one.median_px, 1)} px", highlight=False)
    console.print(result.outcome.note, highlight=False)
    took = result.time
    spent_min = sum(took.spent_s.values()) / 60
    console.print(
        f"{took.simulated_s / 3600:.1f} h of movement simulated in {spent_min:.1f} min, summed over all processes.",
        highlight=False,
    )
    for name, key in (("Page", "report"), ("Report of the study", "study_report"), ("Data set", "dataset")):
        console.print(f"{name}: {getattr(result, key)}", highlight=False, soft_wrap=True)


def _number(value: float | None, digits: int) -> str:
    return "–" if value is None else f"{value:.{digits}f}"
