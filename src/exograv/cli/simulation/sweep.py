"""Command `exograv dev sweep` and the tables of its result."""

from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import tyro

from exograv.campaigns.sweep.options import SweepOptions
from exograv.cli.shell.base_options import OutFolder, write_json
from exograv.options import Acts, read_numbers, words
from exograv.results import json_value

if TYPE_CHECKING:
    from exograv.campaigns.sweep.plan import SweepPlanResult
    from exograv.campaigns.sweep.sweep_command import SweepResult


def _workers_of(text: str) -> tuple[int, ...]:
    return tuple(int(number) for number in read_numbers(text, "--plan-workers"))


PLANNED = Acts(lambda all_: all_.plan, "with --plan")


@dataclass(frozen=True)
class SweepPlan:
    """Study of the sweep, and options for its cost."""

    study: Annotated[Path, tyro.conf.Positional] = field(default=tyro.MISSING)
    """File of the study: kind of task and grid (docs/howto/sweep.md)."""

    plan: bool = False
    """Run nothing. Show the cost of 10⁴, 10⁶ and 10⁸ wearers from the times in the folder of `--out`."""

    price_per_core_hour: Annotated[float | None, PLANNED] = None
    """Price of a core hour at your provider in your currency."""

    plan_workers: Annotated[tuple[int, ...], words(_workers_of), PLANNED] = (2, 100, 1000)
    """Numbers of workers of the plan, separated by commas."""


def run_sweep_command(asked: SweepPlan, options: SweepOptions, common: OutFolder) -> "SweepResult | SweepPlanResult":
    """Run thousands of wearers, machines, disturbances and methods, here or on a cluster. Run it again to continue."""
    from exograv.campaigns.sweep.study_file import load_study
    from exograv.campaigns.sweep.sweep_command import run_sweep
    from exograv.cli.shell.terminal import bars

    study = load_study(asked.study)
    if asked.plan:
        return _plan(asked, common.out)
    print(
        f"{study.title}: {len(study.grid)} tasks. Ctrl-C keeps finished tasks; the same command continues.", flush=True
    )
    with bars() as progress:
        result = run_sweep(study, options, common.out, progress)
    _show(result, f"exograv dev sweep {asked.study} --out {common.out}")
    if result.interrupted:
        if common.json is not None:
            write_json(common.json, json_value(result))
        raise KeyboardInterrupt
    return result


def _show(result: "SweepResult", again: str) -> None:
    rate = "" if result.tasks_per_s is None else f", {result.tasks_per_s:g} tasks/s"
    print(
        f"{result.done} of {result.tasks} done, {result.failed} failed, {result.retried} run again after a "
        f"worker was lost; {result.ran} ran now on {result.workers} ({result.runner}) in "
        f"{result.wall_s:.1f} s{rate}."
    )
    if result.lost:
        print(f"{result.lost} tasks ended every worker that ran them; the same command tries them again.")
    if result.done + result.failed < result.tasks:
        print(f"The remaining tasks are not done. Continue with: {again}")
    if result.table is not None:
        print(f"Table: {result.table}")


def _plan(asked: SweepPlan, folder: Path) -> "SweepPlanResult":
    from rich.console import Console
    from rich.table import Table

    from exograv.campaigns.sweep.plan import plan
    from exograv.campaigns.sweep.study_file import load_study

    workers = asked.plan_workers
    result = plan(load_study(asked.study), folder, workers, asked.price_per_core_hour)
    table = Table("wearers", "core hours", "price", "table", *(f"on {count}" for count in workers), title=result.title)
    for row in result.rows:
        price = "–" if row.price is None else f"{row.price:,.2f}"
        cells = (f"{row.wearers:,}", f"{row.core_h:,.1f}", price, _size(row.table_bytes))
        table.add_row(*cells, *(_time(hours) for hours in row.hours.values()))
    Console().print(table)
    print(result.measured)
    return result


def _size(count: float) -> str:
    return f"{count / 1e9:.1f} GB" if count >= 1e8 else f"{count / 1e6:.1f} MB"


def _time(hours: float) -> str:
    if hours < 1.0:
        return f"{60 * hours:.0f} min"
    if hours < 48.0:
        return f"{hours:.1f} h"
    return f"{hours / 24:.0f} days" if hours < 24 * 730 else f"{hours / 8766:.0f} years"
