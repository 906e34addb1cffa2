"""Command `exograv dev benchmark-identification` and the tables of its result."""

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Annotated

from exograv.campaigns.benchmark_identification.options import BenchmarkOptions
from exograv.cli.shell.base_options import OutFolder, write_json
from exograv.options import Acts, Seed, SeedOption
from exograv.results import json_value

if TYPE_CHECKING:
    from exograv.campaigns.benchmark_identification.benchmark import BenchmarkResult
    from exograv.report.figures.benchmark_result import BenchmarkFiles, BenchmarkSummary

TEXTS = ("method", "where", "stop rule, wearers", "drives", "disturbance")
"""Columns of text. All other columns hold numbers."""


@dataclass(frozen=True)
class FirstSeed(SeedOption):
    """Seed of the first wearer by the name that all commands have."""

    seed: Annotated[Seed, Acts(lambda all_: all_.seed_from is None, "without --seed-from, which says the same")] = 0


def run_benchmark_identification(options: BenchmarkOptions, drawn: FirstSeed, common: OutFolder) -> "BenchmarkResult":
    """Compare all identification methods on the same virtual wearers: time, accuracy, intervals and failures."""
    from exograv.campaigns.benchmark_identification.benchmark import run_benchmark
    from exograv.campaigns.benchmark_identification.tasks import machines
    from exograv.cli.shell.terminal import bars
    from exograv.report.of_benchmarks.identification_benchmark import write_benchmark_page

    if options.seed_from is None:
        options = replace(options, seed_from=drawn.seed)
    planned = machines(options)
    tasks = [task for group in planned for task in group]
    runs = sum(len(task.keys) for task in tasks)
    print(
        f"{len(planned)} machines, {len(tasks)} wearers, {runs} runs of 120 s of motion. Ctrl-C keeps finished runs; "
        "--resume continues."
    )
    with bars() as progress:
        result = run_benchmark(options, common.out, progress)
    if result.interrupted and not result.summary.results:
        raise KeyboardInterrupt  # the page of an earlier benchmark stays
    files = write_benchmark_page(result.summary, common.out)
    result = replace(result, files=files)
    show_benchmark(result.summary, files)
    if result.interrupted:
        if common.json is not None:
            write_json(common.json, json_value(result))
        raise KeyboardInterrupt
    return result


def show_benchmark(result: "BenchmarkSummary", files: "BenchmarkFiles") -> None:
    """Print the tables, the conclusions, and the path of the page."""
    from rich.console import Console
    from rich.table import Table

    from exograv.report.of_benchmarks.identification_benchmark import page_of
    from exograv.report.style.page import Bullets
    from exograv.report.style.page import Table as Rows

    console, chapters = Console(), page_of(result).chapters
    for title, rows in ((one.title, block) for one in chapters for block in one.blocks if isinstance(block, Rows)):
        table = Table(title=title, box=None, padding=(0, 1, 0, 0), header_style="bold underline")
        for heading in rows.columns:
            justify = "left" if heading in TEXTS else "right"
            table.add_column(heading.replace(" ", "\n"), justify=justify, no_wrap=heading == "method")
        for line in rows.rows:
            # Each cell has two short lines, because no terminal has room for one long line.
            table.add_row(*(cell.replace(" / ", "\n").replace(" (", "\n(") for cell in line))
        console.print(table)
    for line in (
        line for one in chapters for block in one.blocks if isinstance(block, Bullets) for line in block.sentences
    ):
        console.print(f"- {line}", highlight=False)
    console.print(f"Tables: {files.page}", highlight=False, soft_wrap=True)
    if files.figure is not None:
        console.print(f"Figure: {files.figure}", highlight=False, soft_wrap=True)
