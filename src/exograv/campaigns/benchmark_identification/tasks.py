"""Runs of the benchmark: every wearer with every method, grouped by machine."""

from dataclasses import replace

from exograv.options import Profile
from exograv.rig.twin.disturbances.levels import ROWS

from .cases import Case, by_machine, population
from .options import BenchmarkOptions
from .work import WearerTask


def machines(options: BenchmarkOptions) -> list[list[WearerTask]]:
    """List all runs, grouped by machine."""
    cases = [
        case for level in options.levels for profile in options.profiles for case in _cases(options, level, profile)
    ]
    return [[_task(options, case) for case in group] for group in by_machine(cases)]


def _cases(options: BenchmarkOptions, level: int, profile: Profile) -> list[Case]:
    kind = options.break_down
    count = options.streams if kind else max(options.wearers, options.streams)
    more = options.only, options.without, options.never_relaxed, options.world
    whole = population(profile, level, count, options.first_seed, *more)
    if kind is None:
        return whole
    # A single disturbance is compared with none at all, a missing one with all.
    reference = whole if kind == "without" else population(profile, 0, count, options.first_seed, world=options.world)
    return [*reference, *(replace(case, **{kind: row}) for row in ROWS for case in whole)]


def _task(options: BenchmarkOptions, case: Case) -> WearerTask:
    k = case.wearer_seed - options.first_seed
    return WearerTask(
        case,
        options.methods if k < options.streams else (),
        options.closed_loop_methods if k < options.wearers else (),
    )
