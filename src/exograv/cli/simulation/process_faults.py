"""Command `exograv dev process-faults` and the table of its result."""

from typing import TYPE_CHECKING

from exograv.campaigns.process_faults.options import ProcessFaultOptions
from exograv.cli.shell.base_options import OutFolder, write_json
from exograv.results import json_value

if TYPE_CHECKING:
    from exograv.campaigns.process_faults.figures import MatrixFigures


def run_process_faults_command(options: ProcessFaultOptions, common: OutFolder) -> "MatrixFigures":
    """Kill, stop and overload each process of real live sessions on simulated drives, and judge them from outside."""
    from exograv.campaigns.process_faults.campaign import MatrixCampaign, run_matrix
    from exograv.cli.shell.terminal import bars

    campaign = MatrixCampaign(**vars(options), out=common.out)
    with bars() as progress:
        result = run_matrix(campaign, progress)
    show_matrix(result)
    print(f"Table: {common.out / 'process_faults.md'}")
    if result.missing:
        print(f"{len(result.missing)} cells are left. Continue with --resume.")
    if result.is_bad:
        if common.json is not None:
            write_json(common.json, json_value(result))
        raise SystemExit(1)
    return result


def show_matrix(result: "MatrixFigures") -> None:
    """Print one line for each cell, then the summary."""
    from rich.console import Console

    console = Console()
    for verdict in result.cells:
        figures = [] if verdict.reaction_ms is None else [f"{verdict.reaction_ms:g} ms"]
        figures += [] if verdict.gaps.worst_ms is None else [f"worst gap {verdict.gaps.worst_ms:g} ms"]
        said = ", ".join([verdict.status, *([verdict.seen] if verdict.seen else []), *figures])
        console.print(f"{verdict.cell}: {said}", highlight=False, soft_wrap=True)
        for fault in verdict.faults:
            console.print(f"    {fault}", highlight=False, markup=False, soft_wrap=True)
    console.print(result.summary(), highlight=False, soft_wrap=True)
