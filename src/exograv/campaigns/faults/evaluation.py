"""Figures of a fault campaign from the verdicts on its scenarios."""

from collections import Counter
from collections.abc import Mapping, Sequence

from exograv.options import WorldName
from exograv.safety.guard import SafeState

from .acceptance import HAND_MAX_M_S, Measure
from .driver_faults import ALL, injected_by
from .fault_table import FAULTS, Fault
from .figures import (
    CampaignFigures,
    FaultFigures,
    HandCount,
    HandFigures,
    MissFigures,
    PairFigures,
    ReactionTimes,
    ScenarioFigures,
)
from .healthy import rate_bound_per_hour
from .known_misses import KNOWN_MISSES
from .scenario import ScenarioVerdict, is_bad

LINES_MAX = 10
"""Largest number of scenarios that are listed per kind."""


def figures_of(
    verdicts: Sequence[ScenarioVerdict],
    faults: Mapping[str, Fault] = FAULTS,
    seed: int = 0,
    level: int = 0,
    through: str | None = None,
    world: WorldName = "home",
) -> CampaignFigures:
    """Compute the figures of all scenarios of a campaign."""
    quiet_h = sum(v.quiet_s for v in verdicts) / 3600.0
    false = [v for v in verdicts if v.false_trip]
    pairs = [v for v in verdicts if len(v.scenario.faults) > 1 and not v.false_trip]
    return CampaignFigures(
        ok=not any(map(is_bad, verdicts)),
        scenarios=len(verdicts),
        ticks=sum(v.course.ticks for v in verdicts),
        envelope_violations=sum(v.course.violated_ticks for v in verdicts),
        violations=[f"{v.scenario.command}: {v.course.violations[0]}" for v in verdicts if v.course.violations][
            :LINES_MAX
        ],
        crashed=[f"{v.scenario.command}: {v.course.crashed}" for v in verdicts if v.course.crashed][:LINES_MAX],
        diverged=sum(v.course.diverged for v in verdicts),
        missed_budgets=sum(len(v.missed) for v in verdicts),
        unexplained_misses=sum(len(v.unexplained) for v in verdicts),
        missed=[f"{v.scenario.command}: {v.figures or v.found}" for v in verdicts if v.unexplained][:LINES_MAX],
        by_fault={name: _of_fault(name, verdicts) for name in faults},
        false_trips=[f"{v.scenario.command}: {v.course.reason}" for v in false],
        false_trips_per_hour=round(len(false) / quiet_h, 2) if quiet_h else 0.0,
        false_trips_per_hour_at_most=round(rate_bound_per_hour(len(false), quiet_h), 4) if quiet_h else None,
        quiet_hours=round(quiet_h, 4),
        drift_messages=sum(map(_is_told_early, verdicts)),
        pairs=PairFigures(len(pairs), sum(bool(v.missed) for v in pairs)),
        relaxed_hand_m_s=_hand(
            [(v, v.course.hand_m_s) for v in verdicts if _is_stopped(v) and len(v.scenario.faults) == 1]
        ),
        relaxed_hand_every_flight_m_s=_hand([(v, v.course.flight_hand_m_s) for v in verdicts]),
        seed=seed,
        disturbance_level=level,
        world=world,
        through=through,
    )


def _is_told_early(verdict: ScenarioVerdict) -> bool:
    """Return True if the drift monitor told the operator before the first fault."""
    told = verdict.course.told_tick
    return told is not None and 1e-3 * verdict.course.period_ms * told < verdict.quiet_s


def _of_fault(name: str, verdicts: Sequence[ScenarioVerdict]) -> FaultFigures:
    alone = [v for v in verdicts if v.scenario.faults == (name,) and not v.false_trip]
    times = [t for v in alone if (t := v.found.get(name)) is not None]
    fault, relaxed = ALL[name], [v for v in alone if v.relaxed]
    hands = HandCount.of([v.course.hand_m_s for v in relaxed if _is_stopped(v)])
    pushed = max((v.course.pushed_hand_m_s for v in alone), default=0.0)
    missed = [v for v in verdicts if name in v.missed]
    return FaultFigures(
        what=fault.what,
        injected_by=injected_by(name),
        runs=sum(name in v.scenario.faults for v in verdicts),
        alone=len(alone),
        detected=len(times),
        reaction_ms=ReactionTimes.of(times),
        budget_ms=fault.budget_ms,
        missed=len(missed),
        safe_state="DRIVES BRAKE" if fault.at_drive else fault.safe_state.name,
        worst_safe_state=max((v.course.worst for v in alone), default=SafeState.NONE).name,
        hand_m_s=hands.max,
        pushed_hand_m_s=round(pushed, 3) if pushed else None,
        extra_speed_rad_s=round(max((v.course.extra_speed for v in alone), default=0.0), 3),
        extra_way_deg=round(max((v.course.extra_way_deg for v in alone), default=0.0), 2),
        known=sum(name not in v.unexplained for v in missed),
        misses=_misses(fault, alone),
        hands_stopped=hands,
        hands=HandCount.of([v.course.flight_hand_m_s for v in relaxed]),
        diverged=sum(v.course.diverged for v in verdicts if name in v.scenario.faults),
        stops=Counter(v.course.reason.name for v in alone if v.course.reason is not None),
    )


def _misses(fault: Fault, alone: Sequence[ScenarioVerdict]) -> dict[str, MissFigures]:
    found: dict[str, MissFigures] = {}
    for measure in Measure:
        flights = [v for v in alone if measure.value in v.figures]
        figures = [v.figures[measure.value] for v in flights]
        if not figures:
            continue
        known, finite = KNOWN_MISSES.get((fault.id, measure)), [one for one in figures if one is not None]
        found[measure.value] = MissFigures(
            limit=fault.budget_ms if measure is Measure.TIME else fault.limits.get(measure),
            runs=len(figures),
            worst=round(max(finite), 3) if len(finite) == len(figures) else None,
            unexplained=sum(known is None or not known.explains(v.figures[measure.value], v.course) for v in flights),
            cause=None if known is None else known.cause,
        )
    return found


def _hand(flights: Sequence[tuple[ScenarioVerdict, float]]) -> HandFigures:
    """Return the hand speeds [m/s] of the flights in which the arm was relaxed."""
    found = [(v, speed) for v, speed in flights if v.relaxed and v.scenario.faults]
    fast = sorted(((v, speed) for v, speed in found if speed > HAND_MAX_M_S), key=lambda one: -one[1])
    cases = [f"{v.scenario.command}: {speed:.2f} m/s" for v, speed in fast]
    count = HandCount.of([speed for _, speed in found])
    return HandFigures(count.runs, count.max, count.above, HAND_MAX_M_S, cases)


def _is_stopped(verdict: ScenarioVerdict) -> bool:
    """Return True if guard or drives stopped the arm."""
    return verdict.course.stopped_tick is not None or verdict.course.braked_tick is not None


def course_of(verdict: ScenarioVerdict) -> ScenarioFigures:
    """Return the figures of one scenario."""
    course = verdict.course
    return ScenarioFigures(
        ticks=course.ticks,
        stopped_tick=course.stopped_tick,
        braked_tick=course.braked_tick,
        reason=None if course.reason is None else course.reason.value,
        worst_safe_state=course.worst.name,
        violations=course.violations,
        crashed=course.crashed,
        found_ms=verdict.found,
        missed=verdict.missed,
        unexplained=verdict.unexplained,
        beyond=verdict.figures,
        false_trip=verdict.false_trip,
        diverged=course.diverged,
        hand_m_s=round(course.hand_m_s, 3),
        pushed_hand_m_s=round(course.pushed_hand_m_s, 3),
        flight_hand_m_s=round(course.flight_hand_m_s, 3),
        extra_speed_rad_s=round(course.extra_speed, 3),
        extra_way_deg=round(course.extra_way_deg, 2),
        drift_deg_s=round(course.drift_deg_s, 2),
        power_W=round(course.power_W, 2),
        injected_J=round(course.injected_J, 3),
        torque_step_Nm=round(course.torque_step_Nm, 4),
        relaxed=verdict.relaxed,
    )
