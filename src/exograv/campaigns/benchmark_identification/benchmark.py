"""`exograv dev benchmark-identification`: all runs, and the figures computed from them."""

import time
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Any

from exograv.loop.pilot import Progress
from exograv.report.figures.benchmark_result import (
    BenchmarkFiles,
    BenchmarkSummary,
    DisturbancePart,
    MethodFigures,
    PairedRatio,
    WearerFigures,
    Winner,
)
from exograv.results import MERGED
from exograv.runtime.processes.process_pool import results_of

from .bootstrap import RESAMPLES
from .comparison import paired, parts, ratios, winner
from .measures import left_over, rounded, rounded_ends, row, time_to
from .options import BenchmarkOptions
from .runs import MethodRun, RunFile
from .stream_replay import DURATIONS_S
from .tasks import machines
from .work import WearerTask, run_machine

FILE = "benchmark_identification.jsonl"

LOST = (
    "Another program ended a process of the benchmark, perhaps because memory ran out. Finished runs are kept: "
    "continue with --resume and fewer --processes."
)

Group = tuple[str, int, str, str | None, str | None, bool]
"""Setting, level, profile, and the variation of the case. Runs of one group may be compared."""


@dataclass(frozen=True)
class BenchmarkResult:
    """Result of `exograv dev benchmark-identification`."""

    summary: BenchmarkSummary = field(metadata=MERGED)
    options: BenchmarkOptions
    bootstrap_resamples: int
    runs_wanted: int
    runs_done: int
    interrupted: bool
    runs_file: Path
    wall_s: float
    files: BenchmarkFiles | None = field(default=None, metadata=MERGED)


def run_benchmark(options: BenchmarkOptions, folder: Path, progress: Progress) -> BenchmarkResult:
    """Run the remaining tasks and compute the figures. Ctrl-C ends the runs early, with the figures so far.

    Raises:
        RecordingError: The folder cannot be written, or its runs cannot be resumed.
    """
    start = time.perf_counter()
    planned = machines(options)
    wanted = {key for tasks in planned for task in tasks for key in task.keys}
    file = RunFile(folder / FILE, options.seconds, options.resume)
    interrupted = _work_off(planned, wanted, options, file, progress)
    runs = sorted((run for run in file.rows if run.key in wanted), key=lambda run: run.case.wearer_seed)
    return BenchmarkResult(
        summary(runs),
        options,
        RESAMPLES,
        len(wanted),
        len(runs),
        interrupted,
        file.path,
        round(time.perf_counter() - start, 1),
    )


def _work_off(
    planned: Sequence[Sequence[WearerTask]],
    wanted: set[Any],
    options: BenchmarkOptions,
    file: RunFile,
    progress: Progress,
) -> bool:
    """Run the remaining tasks. Return True if Ctrl-C interrupted them."""
    done = {run.key for run in file.rows}
    left = [[task.left(done) for task in tasks if task.left(done).keys] for tasks in planned]
    count = len(wanted & done)

    def tell(text: str) -> None:
        progress(f"{count}/{len(wanted)}: {text}", count / len(wanted))

    machines_left = [tasks for tasks in left if tasks]
    arriving = results_of(partial(run_machine, seconds=options.seconds), machines_left, options.processes, tell, LOST)
    try:
        for _, run in arriving:
            file.add(run)
            count += 1
            tell(f"wearer {run.case.wearer_seed}, '{run.method}' done")
    except KeyboardInterrupt:
        return True
    finally:
        arriving.close()
    return False


def summary(runs: Sequence[MethodRun]) -> BenchmarkSummary:
    """Compute all figures of the finished runs."""
    groups = _grouped(runs)
    results, pairs, broken_down = list[MethodFigures](), list[PairedRatio](), list[DisturbancePart]()
    winners: dict[str, dict[str, Winner]] = {}
    for (setting, level, profile, *varied), by_method in groups.items():
        results += [row(of_method) for of_method in by_method.values()]
        common = paired([run for of_method in by_method.values() for run in of_method])
        if any(varied) and any((one[0], one[2]) == (setting, profile) and not any(one[3:]) for one in groups):
            continue  # This group is a part of the breakdown, and is reported there.
        pairs += ratios(common, setting, level, profile)
        if setting == "open_loop":
            winners.setdefault(str(level), {})[profile] = winner(common)
            broken_down += _broken_down(groups, (setting, level, profile), by_method)
    seeds, machine_seeds = ({getattr(run.case, name) for run in runs} for name in ("wearer_seed", "machine_seed"))
    return BenchmarkSummary(
        results, winners, pairs, broken_down, sorted(seeds), sorted(machine_seeds), [_wearer_row(run) for run in runs]
    )


def _grouped(runs: Sequence[MethodRun]) -> dict[Group, dict[str, list[MethodRun]]]:
    """Group the runs by setting and by method, methods in the order in which they were requested."""
    groups: dict[Group, dict[str, list[MethodRun]]] = {}
    for run in runs:
        case = run.case
        key = (run.setting, case.level, case.profile, case.only, case.without, case.restless)
        groups.setdefault(key, {}).setdefault(run.method, []).append(run)
    return groups


def _broken_down(
    groups: dict[Group, dict[str, list[MethodRun]]], place: tuple[str, int, str], references: dict[str, list[MethodRun]]
) -> list[DisturbancePart]:
    """Compare runs with one disturbance switched with the runs of this place, for every method."""
    setting, level, profile = place
    found = []
    for method, reference in references.items():
        for index, kind in ((3, "only"), (4, "without")):
            varied = [
                by_method[method]
                for group, by_method in groups.items()
                if (group[0], group[2]) == (setting, profile)
                and group[index] is not None
                and level == (0 if kind == "only" else group[1])
                and method in by_method
            ]
            found += parts(reference, varied, kind)
    return found


def _wearer_row(run: MethodRun) -> WearerFigures:
    case = run.case
    return WearerFigures(
        setting=run.setting,
        method=run.method,
        level=case.level,
        profile=case.profile,
        wearer_seed=case.wearer_seed,
        machine_seed=case.machine_seed,
        arm=case.arm,
        only=case.only,
        without=case.without,
        never_relaxed=case.restless,
        world=case.world,
        failed=run.failed,
        time_to_target_s=rounded(time_to(run)),
        left_over_Nm={
            f"{t:g}": rounded_ends((left_over(run, t, "shoulder"), left_over(run, t, "elbow"))) for t in DURATIONS_S
        },
        outcome=run.outcome,
        stop_s=run.stop_s,
        method_s=run.method_s,
    )
