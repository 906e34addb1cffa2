"""Figures of a fault campaign."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from exograv.results import OPTIONAL
from exograv.safety.guard import SafeState

from .driver_faults import ALL, injected_by
from .fault_table import FAULTS, Fault
from .fault_tests import TESTED_FAULTS, UNTESTED_FAULTS
from .scenario import HAND_MAX_M_S, ScenarioVerdict, is_bad

LINES_MAX = 10
"""Largest number of scenarios that are listed per kind."""


@dataclass(frozen=True)
class ReactionTimes:
    """Percentiles of reaction times [ms]; None if there are none."""

    p50: float | None = None
    p99: float | None = None
    max: float | None = None

    @classmethod
    def of(cls, times_ms: Sequence[float]) -> "ReactionTimes":
        """Return the percentiles of these times."""
        return cls(*np.percentile(times_ms, [50, 99, 100]).round(2).tolist()) if times_ms else cls()


@dataclass(frozen=True)
class FaultFigures:
    """Figures of one fault in scenarios."""

    what: str
    injected_by: str
    runs: int
    alone: int
    """Number of runs with this fault only, in which the guard did not stop before the fault.

    The measured fields below refer to these runs, except `missed`. `budget_ms` and `safe_state` are requirements of the
    fault table.
    """

    detected: int
    reaction_ms: ReactionTimes
    budget_ms: float | None
    missed: int
    safe_state: str
    worst_safe_state: str
    hand_m_s: float | None
    """Largest speed of a relaxed arm's hand after a stop [m/s]; None if no run measured it."""

    pushed_hand_m_s: float | None
    extra_speed_rad_s: float
    extra_way_deg: float


@dataclass(frozen=True)
class StrikeFigures:
    """Figures of one kind of strike at the processes of a live run, on the machine's clock."""

    what: str
    runs: int
    alone: int
    """Strikes with no safe state in force before."""

    detected: int
    reaction_ms: ReactionTimes
    budget_ms: float | None
    missed: int
    safe_state: str
    stall_ms: float | None
    """Longest delay caused by the computer itself [ms]; None if no delay was measured."""

    command_p999_us: "AroundStrikes"
    acknowledged_missing: int
    hand_m_s: None = None


@dataclass(frozen=True)
class AroundStrikes:
    """Time from the start of a period to its command, 99.9th percentile, before and after the strikes [µs]."""

    before: float | None
    after: float | None


@dataclass(frozen=True)
class GuardEndFigures:
    """Figures of the run whose guard was killed."""

    what: str
    runs: int
    alone: int
    detected: int
    reaction_ms: ReactionTimes
    ended_ms: float | None
    """Time from the kill of the guard until the parent process reported its end [ms]; None if it reported no end."""

    budget_ms: None
    missed: int
    safe_state: str
    hand_m_s: None = None


@dataclass(frozen=True)
class StruckRun:
    """Live run under strikes: recording against acknowledged samples, and all commands against the envelope."""

    outcome: str
    recording: str
    ticks: int
    envelope_violations: int
    samples_acknowledged: int
    samples_lost: int
    """Ticks lost because the recorder's ring buffer was full; none of them was acknowledged."""

    acknowledged_missing: int
    control_restarts: int
    recorder_restarts: int
    not_struck: list[str] = field(default_factory=list)
    granted: Sequence[str] = ()
    """Real-time rights that the system granted."""


@dataclass(frozen=True)
class Strikes:
    """Results of strikes at real processes."""

    live: StruckRun
    by_fault: Mapping[str, StrikeFigures | GuardEndFigures]
    violations: Sequence[str]


@dataclass(frozen=True)
class PairFigures:
    """Scenarios with two faults at the same time, judged by the sum of both budgets."""

    runs: int
    missed: int


@dataclass(frozen=True)
class HandFigures:
    """Hand speeds of relaxed arms after a stop that one fault caused, while the wearer does not push [m/s]."""

    runs: int
    max: float | None
    above: int
    allowed: float
    cases: list[str]


@dataclass(frozen=True)
class ScenarioFigures:
    """Figures of one scenario that was simulated again (`--replay`)."""

    ticks: int
    stopped_tick: int | None
    braked_tick: int | None
    reason: str | None
    worst_safe_state: str
    violations: list[str]
    crashed: str | None
    found_ms: Mapping[str, float | None]
    missed: Sequence[str]
    false_trip: bool
    hand_m_s: float
    pushed_hand_m_s: float
    extra_speed_rad_s: float
    extra_way_deg: float
    torque_step_Nm: float
    relaxed: bool


@dataclass(frozen=True)
class CampaignFigures:
    """Result of `exograv dev faults`."""

    ok: bool
    scenarios: int
    ticks: int
    envelope_violations: int
    violations: list[str]
    crashed: list[str]
    missed_budgets: int
    missed: list[str]
    by_fault: Mapping[str, FaultFigures | StrikeFigures | GuardEndFigures]
    false_trips: list[str]
    false_trips_per_hour: float
    quiet_hours: float
    pairs: PairFigures
    relaxed_hand_m_s: HandFigures
    seed: int
    disturbance_level: int
    through: str | None
    proved_by: Mapping[str, Sequence[str]] = field(
        default_factory=lambda: {row.id: row.proved_by for row in TESTED_FAULTS}
    )
    """Tests that show a fault without a scenario, by the identifier of the fault, such as F19."""

    not_yet: Mapping[str, str] = field(default_factory=lambda: dict(UNTESTED_FAULTS))
    live: StruckRun | None = None
    replay: list[str] = field(default_factory=list)
    """Commands that replay the failed scenarios."""

    course: ScenarioFigures | None = field(default=None, metadata=OPTIONAL)

    def with_strikes(self, found: Strikes) -> "CampaignFigures":
        """Add the results of strikes at real processes. The figures of the scenarios stay as they are."""
        missed = sum(row.missed for row in found.by_fault.values())
        return replace(
            self,
            ok=self.ok and not (missed or found.live.envelope_violations),
            envelope_violations=self.envelope_violations + found.live.envelope_violations,
            violations=[*self.violations, *found.violations],
            missed_budgets=self.missed_budgets + missed,
            by_fault={**self.by_fault, **found.by_fault},
            live=found.live,
        )


def figures_of(
    verdicts: Sequence[ScenarioVerdict],
    faults: Mapping[str, Fault] = FAULTS,
    seed: int = 0,
    level: int = 0,
    through: str | None = None,
) -> CampaignFigures:
    """Compute the figures of all scenarios of a campaign."""
    quiet_h = sum(v.quiet_s for v in verdicts) / 3600.0
    false = [v for v in verdicts if v.false_trip]
    pairs = [v for v in verdicts if len(v.scenario.faults) == 2 and not v.false_trip]
    return CampaignFigures(
        ok=not any(map(is_bad, verdicts)),
        scenarios=len(verdicts),
        ticks=sum(v.course.ticks for v in verdicts),
        envelope_violations=sum(v.course.violated_ticks for v in verdicts),
        violations=[f"{v.scenario.command}: {v.course.violations[0]}" for v in verdicts if v.course.violations][
            :LINES_MAX
        ],
        crashed=[f"{v.scenario.command}: {v.course.crashed}" for v in verdicts if v.course.crashed][:LINES_MAX],
        missed_budgets=sum(len(v.missed) for v in verdicts),
        missed=[f"{v.scenario.command}: {v.found}" for v in verdicts if v.missed][:LINES_MAX],
        by_fault={name: _of_fault(name, verdicts) for name in faults},
        false_trips=[f"{v.scenario.command}: {v.course.reason}" for v in false],
        false_trips_per_hour=round(len(false) / quiet_h, 2) if quiet_h else 0.0,
        quiet_hours=round(quiet_h, 4),
        pairs=PairFigures(len(pairs), sum(bool(v.missed) for v in pairs)),
        relaxed_hand_m_s=_hand(verdicts),
        seed=seed,
        disturbance_level=level,
        through=through,
    )


def _of_fault(name: str, verdicts: Sequence[ScenarioVerdict]) -> FaultFigures:
    alone = [v for v in verdicts if v.scenario.faults == (name,) and not v.false_trip]
    times = [t for v in alone if (t := v.found.get(name)) is not None]
    fault, hands = ALL[name], [v.course.hand_m_s for v in alone if v.relaxed and _is_stopped(v)]
    pushed = max((v.course.pushed_hand_m_s for v in alone), default=0.0)
    return FaultFigures(
        what=fault.what,
        injected_by=injected_by(name),
        runs=sum(name in v.scenario.faults for v in verdicts),
        alone=len(alone),
        detected=len(times),
        reaction_ms=ReactionTimes.of(times),
        budget_ms=fault.budget_ms,
        missed=sum(name in v.missed for v in verdicts),
        safe_state="DRIVES BRAKE" if fault.at_drive else fault.safe_state.name,
        worst_safe_state=max((v.course.worst for v in alone), default=SafeState.NONE).name,
        hand_m_s=round(max(hands), 3) if hands else None,
        pushed_hand_m_s=round(pushed, 3) if pushed else None,
        extra_speed_rad_s=round(max((v.course.extra_speed for v in alone), default=0.0), 3),
        extra_way_deg=round(max((v.course.extra_way_deg for v in alone), default=0.0), 2),
    )


def _hand(verdicts: Sequence[ScenarioVerdict]) -> HandFigures:
    found = [v for v in verdicts if v.relaxed and len(v.scenario.faults) == 1 and _is_stopped(v)]
    speeds = [v.course.hand_m_s for v in found]
    fast = [v for v in found if v.course.hand_m_s > HAND_MAX_M_S]
    cases = [f"{v.scenario.command}: {v.course.hand_m_s:.2f} m/s" for v in fast]
    return HandFigures(len(speeds), round(max(speeds), 3) if speeds else None, len(fast), HAND_MAX_M_S, cases)


def _is_stopped(verdict: ScenarioVerdict) -> bool:
    """Return True if guard or drives stopped the arm. The hand speed is recorded only then."""
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
        false_trip=verdict.false_trip,
        hand_m_s=round(course.hand_m_s, 3),
        pushed_hand_m_s=round(course.pushed_hand_m_s, 3),
        extra_speed_rad_s=round(course.extra_speed, 3),
        extra_way_deg=round(course.extra_way_deg, 2),
        torque_step_Nm=round(course.torque_step_Nm, 4),
        relaxed=verdict.relaxed,
    )
