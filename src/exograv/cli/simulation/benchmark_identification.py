"""`exograv benchmark-identification`."""

from dataclasses import dataclass
from typing import Any, Literal

from exograv.cli.shell.base_options import Common, write_json

STAGE_0_S, STREAM_S, METHOD_S = 20.0, 8.0, 6.0
"""Measured on one core of a server: a machine, a wearer, and one method on one wearer in the middle."""


@dataclass(frozen=True)
class BenchmarkIdentification(Common):
    """Every identification method on the same virtual wearers: how soon, how near, how honest, how often possible."""

    wearers: int = 3
    """Wearers in closed loop, where the estimate drives the arm (finalists only)."""

    streams: int = 3
    """Recorded streams that every method meets alike."""

    levels: str = "2"
    """Disturbance levels by commas, 0 (none) to 4 (a bad day)."""

    profiles: str = "harmonic"
    """Kinds of drive by commas: harmonic, qdd."""

    methods: str | None = None
    """Methods by commas; all if absent."""

    seed_from: int | None = None
    """Seed of the first wearer, `--seed` if absent; the others follow it. Tune from 1000 on, report from 0."""

    only: str | None = None
    """One disturbance at the level, all others at level 0."""

    without: str | None = None
    """One disturbance switched off."""

    never_relaxed: bool = False
    """Wearers who never let go: their muscles stir as at level 4, all else stays at the level."""

    break_down: Literal["without", "only"] | None = None
    """Every disturbance in turn switched off, or alone: what the remainder is made of. Open loop only."""

    processes: int = 1
    """At the same time; update times are fair only with a free core for each."""

    resume: bool = False
    """Go on with the runs in the folder of `--out`."""


def run_benchmark_identification(command: BenchmarkIdentification) -> dict[str, Any]:
    """Run it, show its tables, and write table and figure into the folder of `--out`."""
    from exograv.campaigns.benchmark_identification.benchmark import run_benchmark
    from exograv.campaigns.benchmark_identification.options import (
        BenchmarkOptions,
        levels_of,
        machines,
        methods_of,
        profiles_of,
    )
    from exograv.cli.shell.terminal import bars
    from exograv.report.of_benchmarks.identification_benchmark import write_benchmark_page

    chosen: dict[str, Any] = {} if command.methods is None else {"methods": methods_of(command.methods)}
    options = BenchmarkOptions(
        wearers=command.wearers,
        streams=command.streams,
        levels=levels_of(command.levels),
        profiles=profiles_of(command.profiles),
        seed_from=command.seed if command.seed_from is None else command.seed_from,
        only=command.only,
        without=command.without,
        never_relaxed=command.never_relaxed,
        break_down=command.break_down,
        processes=command.processes,
        resume=command.resume,
        **chosen,
    )
    planned = machines(options)
    tasks = [task for group in planned for task in group]
    runs = sum(len(task.keys) for task in tasks)
    seconds = STAGE_0_S * len(planned) + STREAM_S * len(tasks) + METHOD_S * runs
    print(
        f"{len(planned)} machines, {len(tasks)} wearers, {runs} runs of 120 s of motion: about "
        f"{seconds / 60 / options.processes:.0f} minutes. Ctrl-C keeps what is done; --resume goes on."
    )
    with bars() as progress:
        result = run_benchmark(options, command.out, progress)
    page, picture = write_benchmark_page(result, command.out)
    result |= {"page": str(page), "figure": None if picture is None else str(picture)}
    show_benchmark(result)
    if result["interrupted"]:
        if command.json is not None:
            write_json(command.json, result)
        raise KeyboardInterrupt
    return result


def show_benchmark(result: dict[str, Any]) -> None:
    """The tables, who won, and where the page is."""
    from rich.console import Console
    from rich.table import Table

    from exograv.report.of_benchmarks.identification_benchmark import (
        HEADINGS,
        break_down_table,
        sentences,
        tables,
        told,
        verdicts,
    )

    console = Console()
    for title, lines in tables(told(result)):
        table = Table(title=title, box=None, padding=(0, 1, 0, 0), header_style="bold underline")
        for heading in HEADINGS:
            is_name = heading == "method"
            table.add_column(heading.replace(" ", "\n"), justify="left" if is_name else "right", no_wrap=is_name)
        for line in lines:
            # Two short lines each in place of one that no terminal has room for.
            table.add_row(*(cell.replace(" / ", "\n").replace(" (", "\n(") for cell in line))
        console.print(table)
    for title, (headings, lines) in (
        ("What was said about the wearers", verdicts(told(result))),
        ("What the remainder after 120 s is made of, N·m", break_down_table(result)),
    ):
        table = Table(*headings, title=title, box=None, padding=(0, 1, 0, 0), header_style="bold underline")
        for line in lines:
            table.add_row(*line)
        if lines:
            console.print(table)
    for line in sentences(result):
        console.print(line, highlight=False)
    console.print(f"Tables: {result['page']}", highlight=False, soft_wrap=True)
    if result["figure"] is not None:
        console.print(f"Figure: {result['figure']}", highlight=False, soft_wrap=True)
