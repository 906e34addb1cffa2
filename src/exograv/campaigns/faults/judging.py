"""Verdict on the log of a scenario, by the criteria of the fault table."""

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from jaxtyping import Bool

from exograv.safety.guard import SafeState

from .acceptance import ALWAYS, Measure
from .driver_faults import ALL
from .fault_table import Fault
from .known_misses import KNOWN_MISSES
from .scenario_log import ScenarioLog


@dataclass(frozen=True)
class Misses:
    """Criteria that a flight misses."""

    figures: Mapping[str, float | None] = field(default_factory=dict)
    """Missed figures by the name of their measure; None for a fault that was not found in time. Only single faults have
    figures; the faults of a group are judged together."""

    missed: tuple[str, ...] = ()
    """Faults with a missed criterion."""

    unexplained: tuple[str, ...] = ()
    """Faults with a miss that `KNOWN_MISSES` does not explain."""


def detection_begin(course: ScenarioLog, fault: Fault, shows: Bool[np.ndarray, " tick"]) -> float:
    """Tick from which the detection time counts; infinite if the fault never showed for long enough.

    A fault that stops showing and shows again starts anew. Its time counts from the beginning of the last stretch
    before the stop, or of the first stretch that was long enough for a detection.
    """
    ticks, budget = len(shows), _budget(fault) / course.period_ms
    edges = np.flatnonzero(np.diff(shows.astype(int), prepend=0, append=0)).reshape(-1, 2)
    for begin, end in edges.tolist():
        is_last = end == ticks or (course.stopped_tick is not None and course.stopped_tick <= end + budget)
        if is_last or end - begin > budget:
            return float(begin)
    return np.inf


def detection_ms(course: ScenarioLog, fault: Fault, begin: float) -> float | None:
    """Time until the safe state was reached for a permitted reason [ms]; None if it was not reached.

    For a fault that requires only a message: the time until the message to the operator, if that was earlier.
    """
    if fault.at_drive:
        tick = course.braked_tick
    else:
        tick = course.since.get(fault.safe_state) if course.reason in fault.reasons else None
        told = course.told_tick
        if fault.told_suffices and told is not None and told >= begin and (tick is None or told < tick):
            tick = told
    return None if tick is None else course.period_ms * max(tick - begin, 0.0)


def misses_of_one(course: ScenarioLog, fault: Fault, begin: float, relaxed: bool) -> Misses:
    """Judge a flight with one fault by the time allowed for the fault's detection and by the limits of its measures."""
    found = detection_ms(course, fault, begin)
    figures: dict[str, float | None] = {}
    if fault.is_borne:
        if fault.safe_state is SafeState.BRIDGE and course.worst > SafeState.BRIDGE:
            figures[Measure.STATE.value] = float(course.worst)
    elif _is_late(course, fault, found, begin):
        figures[Measure.TIME.value] = found
    judged = {
        measure: float(getattr(course, measure.value))
        for measure in fault.limits
        if relaxed or measure in ALWAYS
    }  # fmt: skip
    # An infinite figure has no JSON form and is kept as None.
    beyond = {
        measure.value: figure if np.isfinite(figure) else None
        for measure, figure in judged.items()
        if not figure <= fault.limits[measure]
    }
    if fault.one_suffices and not (relaxed and figures and beyond):
        return Misses()
    figures |= beyond
    known = [KNOWN_MISSES.get((fault.id, Measure(name))) for name in figures]
    explained = all(
        miss is not None and miss.explains(figure, course) for miss, figure in zip(known, figures.values(), strict=True)
    )
    missed = (fault.id,) if figures else ()
    return Misses(figures, missed, () if explained else missed)


def _is_late(course: ScenarioLog, fault: Fault, found: float | None, begin: float) -> bool:
    if found is None:
        return begin + _budget(fault) / course.period_ms < course.ticks
    return found > _budget(fault)


def misses_of_group(course: ScenarioLog, begins: Mapping[str, float]) -> Misses:
    """Judge a flight with several faults by the sum of their budgets.

    A miss is explained if the flight keeps the sum with each known miss in place of its budget.
    """
    names, budgets = tuple(begins), {name: _budget(ALL[name]) for name in begins}
    if not _is_group_late(course, begins, budgets):
        return Misses()
    known: dict[str, float] = {}
    for name, budget in budgets.items():
        miss = KNOWN_MISSES.get((name, Measure.TIME))
        known[name] = budget if miss is None else np.inf if miss.up_to is None else miss.up_to
    found_in_time = {name: begin for name, begin in begins.items() if np.isfinite(known[name])}
    return Misses({}, names, names if _is_group_late(course, found_in_time, known) else ())


def _is_group_late(course: ScenarioLog, begins: Mapping[str, float], budgets: Mapping[str, float]) -> bool:
    """Return True if no safe state was reached within the sum of all budgets after the first detectable fault.

    One fault may hide the other or the other's safe state, so the weakest of all safe states is required.
    """
    to_find = {name: begin for name, begin in begins.items() if not ALL[name].is_borne}
    until = min(to_find.values(), default=np.inf) + sum(budgets[name] for name in begins) / course.period_ms
    if until >= course.ticks:
        return False
    least = min(ALL[name].safe_state for name in to_find)
    if all(ALL[name].at_drive for name in to_find):
        ticks = [course.braked_tick]
    else:
        ticks = [course.since.get(max(least, SafeState.DESCENT)), course.braked_tick]
    return min((tick for tick in ticks if tick is not None), default=np.inf) > until


def _budget(fault: Fault) -> float:
    return fault.budget_ms or 0.0
