"""Comparison of methods on the same wearers: ratios of times, winners, and the parts of the RMS residual torque."""

from collections.abc import Callable, Mapping, Sequence

import numpy as np

from exograv.report.figures.benchmark_result import DisturbancePart, MedianFigures, PairedRatio, Winner
from exograv.rig.twin.disturbances.levels import ROWS
from exograv.study.targets import TARGET_NM

from . import bootstrap
from .bootstrap import Values
from .measures import COARSE, left_over, rounded, rounded_ends, time_to, with_interval
from .runs import MethodRun

OURS = "recursive"
RIVALS = ("gradient", "gradient-full")
TIE_SHARE = 0.025
"""Share of resamples above which a method counts as tied with the winner: it is no worse in them [-]."""

CRITERIA: Mapping[str, Callable[[MethodRun], float]] = {
    "time to target": time_to,
    "time to the coarse target": lambda run: time_to(run, COARSE),
    "left over after 60 s": lambda run: worst_of_targets(run, 60.0),
}
"""Criteria for a winner. The first one in which a method's median is finite decides."""

ByMethod = Mapping[str, Sequence[MethodRun]]
"""Runs by method, of the same wearers in the same order."""


def worst_of_targets(run: MethodRun, seconds: float) -> float:
    """Left over at the joint farthest from its target, relative to that target [-]."""
    return max(left_over(run, seconds, place) / TARGET_NM[place] for place in ("shoulder", "elbow"))


def paired(runs: Sequence[MethodRun]) -> dict[str, list[MethodRun]]:
    """Group runs by method, only of wearers that every method has met, in the order of their seeds."""
    by_method: dict[str, dict[int, MethodRun]] = {}
    for run in runs:
        by_method.setdefault(run.method, {})[run.case.wearer_seed] = run
    common = sorted(set.intersection(*(set(of_wearers) for of_wearers in by_method.values())))
    return {name: [of_wearers[seed] for seed in common] for name, of_wearers in by_method.items()}


def ratios(by_method: ByMethod, setting: str = "", level: int = 0, profile: str = "") -> list[PairedRatio]:
    """Return the ratio of our method's time to that of each rival under these conditions; below 1 ours is faster."""
    found = list[PairedRatio]()
    for rival in RIVALS if OURS in by_method else ():
        if not by_method.get(rival):
            continue
        for name, of_time in (("target", time_to), ("coarse", CRITERIA["time to the coarse target"])):
            a, b = (np.array([of_time(run) for run in by_method[method]]) for method in (OURS, rival))
            value, ends = bootstrap.ratio(a, b)
            found.append(
                PairedRatio(
                    setting=setting,
                    level=level,
                    profile=profile,
                    ours=OURS,
                    rival=rival,
                    threshold=name,
                    ratio_of_medians=rounded(value),
                    ci95=rounded_ends(ends),
                    wearers=len(a),
                    ours_sooner=int((a < b).sum()),
                    rival_sooner=int((b < a).sum()),
                    same_time=int(((a == b) & np.isfinite(a)).sum()),
                    neither_reached=int((np.isinf(a) & np.isinf(b)).sum()),
                )
            )
    return found


def winner(by_method: ByMethod) -> Winner:
    """Online method with the best median, the criterion, and the methods tied with it.

    Off-line methods are listed where they are ahead: they estimate three times in all, not every second.
    """
    online = [name for name, runs in by_method.items() if not any(run.offline for run in runs)]
    for criterion, figure in CRITERIA.items():
        values = {name: np.array([figure(run) for run in runs]) for name, runs in by_method.items()}
        best = min(online, key=lambda name: bootstrap.median(values[name]), default=None)
        if best is not None and np.isfinite(bootstrap.median(values[best])):
            median = bootstrap.median(values[best])
            tied = [name for name in online if name != best and _is_tied(values[name], values[best])]
            ahead = [name for name in values if name not in online and bootstrap.median(values[name]) < median]
            return Winner(best, criterion, rounded(median), tied, ahead)
    return Winner(None, "no method gave a result")


def _is_tied(other: Values, best: Values) -> bool:
    """Return True if the paired resamples do not separate the two methods."""
    theirs, bests = bootstrap.medians(other), bootstrap.medians(best)
    return bool((theirs <= bests).mean() >= TIE_SHARE and np.isfinite(bootstrap.median(other)))


def parts(reference: Sequence[MethodRun], varied: Sequence[Sequence[MethodRun]], kind: str) -> list[DisturbancePart]:
    """Change of the RMS residual torque after 120 s by each disturbance, the largest first.

    Args:
        reference: All wearers, at the level if one row is switched off ("without"), at level 0 if one row is alone
            ("only").
        varied: Runs of the same wearers with one row switched, one entry per row.
        kind: "without" or "only".
    """
    rows = [_part(reference, runs, kind) for runs in varied]
    return sorted(rows, key=lambda one: -abs(one.shoulder_change_Nm.median or 0.0))


def _part(reference: Sequence[MethodRun], runs: Sequence[MethodRun], kind: str) -> DisturbancePart:
    before = {run.case.wearer_seed: run for run in reference}
    pairs = [(before[run.case.wearer_seed], run) for run in runs if run.case.wearer_seed in before]
    case = runs[0].case
    row = (case.only if kind == "only" else case.without) or ""
    shoulder, elbow = (_change(pairs, place) for place in ("shoulder", "elbow"))
    return DisturbancePart(
        row, ROWS[row].meaning, kind, runs[0].method, case.profile, case.level, len(pairs), *shoulder, *elbow
    )


def _change(
    pairs: Sequence[tuple[MethodRun, MethodRun]], place: str
) -> tuple[float | None, float | None, MedianFigures]:
    """Medians of left over before and after, and of its change."""
    values = np.array([[left_over(run, 120.0, place) for run in pair] for pair in pairs]).reshape(-1, 2)
    with np.errstate(invalid="ignore"):
        change = values[:, 1] - values[:, 0]
    before, after = (rounded(bootstrap.median(values[:, k])) for k in (0, 1))
    return before, after, with_interval(change[np.isfinite(change)])
