"""Measures of one method on many wearers: one row of the result."""

from collections.abc import Sequence

import numpy as np
from jaxtyping import Float

from exograv.report.figures.benchmark_result import (
    Coverage,
    Ends,
    LearningCurves,
    MedianFigures,
    MethodFigures,
    PlaceFigures,
    TimePercentiles,
)
from exograv.study.targets import TARGET_NM

from . import bootstrap
from .bootstrap import Values
from .runs import MethodRun
from .stream_replay import DURATIONS_S

COARSE = 2.5
"""Factor of the coarse target over the target [-]: 0.5 and 0.25 N·m."""

SLACK_S = 0.01


def table(run: MethodRun) -> Float[np.ndarray, "estimate joint"]:
    """Left over (total) of every estimate [N·m]; infinite where it is not a number."""
    rows = [[np.inf if value is None else value for value in row] for row in run.left_over_Nm]
    return np.array(rows, dtype=float).reshape(len(run.t), len(run.places))


def time_to(run: MethodRun, factor: float = 1.0) -> float:
    """Motion time until left over stays below `factor` times the target to the end [s]; infinite if never."""
    limits = factor * np.array([TARGET_NM[place] for place in run.places])
    within = np.all(table(run) <= limits, axis=1).reshape(-1)
    if not len(within) or not within[-1]:
        return np.inf
    outside = np.flatnonzero(~within)
    return run.t[outside[-1] + 1 if len(outside) else 0]


def left_over(run: MethodRun, seconds: float, place: str) -> float:
    """Left over after this motion time at the worst joint of a place, RMS over the held-out postures [N·m]."""
    within = [k for k, t in enumerate(run.t) if t <= seconds + SLACK_S]
    joints = [j for j, where in enumerate(run.places) if where == place]
    return float(table(run)[within[-1], joints].max()) if within and joints else np.inf


def row(runs: Sequence[MethodRun]) -> MethodFigures:
    """Compute all figures of one method in one setting, from one run per wearer."""
    first = runs[0]
    fine, coarse = (np.array([time_to(run, factor) for run in runs]) for factor in (1.0, COARSE))
    stop_s = np.array([np.inf if run.stop_s is None else run.stop_s for run in runs])
    finished = [run for run in runs if run.failed is None]
    durations, last = {f"{t:g}": t for t in DURATIONS_S}, f"{DURATIONS_S[-1]:g}"
    return MethodFigures(
        method=first.method,
        level=first.case.level,
        profile=first.case.profile,
        setting=first.setting,
        only=first.case.only,
        without=first.case.without,
        never_relaxed=first.case.restless,
        world=first.case.world,
        offline=any(run.offline for run in runs),
        wearers=len(runs),
        failed=len(runs) - len(finished),
        time_to_target_s=with_interval(fine),
        time_to_coarse_s=with_interval(coarse),
        reached_share=share(np.isfinite(fine)),
        reached_coarse_share=share(np.isfinite(coarse)),
        reached_within_share={name: share(fine <= t + SLACK_S) for name, t in durations.items()},
        left_over_Nm={
            name: PlaceFigures(*(median_left_over(runs, t, place) for place in ("shoulder", "elbow")))
            for name, t in durations.items()
        },
        coverage95=coverage(runs, last),
        coverage95_by_duration={name: coverage(runs, name) for name in durations},
        coverage95_torque_by_duration={name: torque_coverage(runs, name) for name in durations},
        coverage95_by_parameter=by_parameter(runs, last),
        consistent_share=share(np.array([run.possible_share for run in finished])),
        outcomes=outcomes(runs),
        stop_s=rounded(bootstrap.median(stop_s)),
        told_restless_share=share(np.array([run.restless_s is not None for run in finished])),
        rejected_share=mean_of([run.rejected_share for run in finished]),
        noise_scale=mean_of([run.noise_scale for run in finished]),
        update_us=times_us([run.update_us for run in runs]),
        estimate_us=times_us([run.estimate_us for run in runs]),
        work_share=mean_of([run.work_share for run in finished]),
        method_s=mean_of([run.method_s for run in finished]),
        progress=progress(runs),
    )


def with_interval(values: Values) -> MedianFigures:
    """Return the median and its 95 % interval by bootstrap."""
    return MedianFigures(rounded(bootstrap.median(values)), rounded_ends(bootstrap.interval(bootstrap.medians(values))))


def rounded_ends(interval: tuple[float, float]) -> Ends:
    """Round the ends of an interval for files."""
    return rounded(interval[0]), rounded(interval[1])


def median_left_over(runs: Sequence[MethodRun], seconds: float, place: str) -> float | None:
    """Median of left over at a place over the wearers [N·m]."""
    return rounded(bootstrap.median(np.array([left_over(run, seconds, place) for run in runs])))


def coverage(runs: Sequence[MethodRun], seconds: str) -> Coverage:
    """Coverage of the parameters' intervals, all wearers together; 0 of 0 for a method without intervals."""
    held = [
        covered for run in runs if seconds in run.intervals for covered in run.intervals[seconds].parameters.values()
    ]
    return Coverage(sum(held), len(held))


def torque_coverage(runs: Sequence[MethodRun], seconds: str) -> Coverage:
    """Coverage of the intervals of the arm's torque at held-out postures."""
    pairs = [run.intervals[seconds].torque for run in runs if seconds in run.intervals]
    return Coverage(sum(pair[0] for pair in pairs), sum(pair[1] for pair in pairs))


def by_parameter(runs: Sequence[MethodRun], seconds: str) -> dict[str, Coverage]:
    """Coverage by name of the parameter."""
    held: dict[str, list[bool]] = {}
    for run in runs:
        for name, covered in run.intervals[seconds].parameters.items() if seconds in run.intervals else ():
            held.setdefault(name, []).append(covered)
    return {name: Coverage(sum(one), len(one)) for name, one in held.items()}


def outcomes(runs: Sequence[MethodRun]) -> dict[str, int]:
    """Count each verdict of the stop rule; "FAILED" for a run without a result."""
    names = ["FAILED" if run.failed is not None else run.outcome for run in runs]
    return {name: names.count(name) for name in sorted(set(names))}


def times_us(of_runs: Sequence[dict[str, float] | None]) -> TimePercentiles:
    """Percentiles over the timed runs."""
    timed = [one for one in of_runs if one is not None]
    if not timed:
        return TimePercentiles()
    p50, p99 = (round(float(np.median([one[key] for one in timed])), 2) for key in ("p50", "p99"))
    return TimePercentiles(p50, p99, max(one["max"] for one in timed))


def progress(runs: Sequence[MethodRun]) -> LearningCurves:
    """Quartiles of left over against time, for the figure."""
    times = max((run.t for run in runs), key=len, default=[])
    curves = list[list[list[float | None]]]()
    for place in ("shoulder", "elbow"):
        ordered = np.sort([_course(run, times, place) for run in runs], axis=0)
        # Ranks are used because infinite values have no mean.
        ranks = [round(quarter * (len(runs) - 1)) for quarter in (0.25, 0.5, 0.75)]
        curves.append([[rounded(value) for value in ordered[rank]] for rank in ranks])
    return LearningCurves(list(times), *curves)


def _course(run: MethodRun, times: Sequence[float], place: str) -> Float[np.ndarray, " time"]:
    """Left over at many times."""
    joints = [j for j, where in enumerate(run.places) if where == place]
    worst = np.append(np.max(table(run)[:, joints], axis=1, initial=0.0), np.inf)
    # Index -1 is before the first estimate; nothing is known then, so the value is infinite.
    return worst[np.searchsorted(np.array(run.t), np.array(times) + SLACK_S, side="right") - 1]


def share(values: np.ndarray) -> float | None:
    """Mean of booleans or of shares; None if empty."""
    return round(float(np.mean(values)), 4) if len(values) else None


def mean_of(values: Sequence[float]) -> float | None:
    """Mean of the values; None if empty."""
    return round(float(np.mean(values)), 5) if values else None


def rounded(value: float) -> float | None:
    """Round a value for files; None if it is infinite or undefined."""
    return round(value, 4) if np.isfinite(value) else None
