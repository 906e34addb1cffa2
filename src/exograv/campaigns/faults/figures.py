"""Figures of a fault campaign."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from exograv.results import OPTIONAL

from .acceptance import HAND_MAX_M_S
from .fault_tests import TESTED_FAULTS, UNTESTED_FAULTS


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

    known: int = 0
    """Number of misses in `missed` whose cause is known and explains their figures."""

    misses: Mapping[str, "MissFigures"] = field(default_factory=dict)
    """Missed criteria of the runs with this fault only, by measure."""

    hands_stopped: "HandCount | None" = None
    """Hands of relaxed arms after a stop of guard or drives."""

    hands: "HandCount | None" = None
    """Hands of relaxed arms in all runs, stopped or not, from the onset of the fault on."""

    diverged: int = 0
    """Number of runs, also with other faults, in which the simulation diverged."""

    stops: Mapping[str, int] = field(default_factory=dict)
    """Number of runs with this fault only by their stop reason."""


@dataclass(frozen=True)
class MissFigures:
    """Runs that miss one criterion of the fault table."""

    limit: float | None
    """Budget or limit of the fault table; None for a safe state that must not occur."""

    runs: int
    worst: float | None
    """Largest figure of these runs; None if the fault was not found, or the figure was infinite."""

    unexplained: int
    """Number of these runs that the known cause does not explain."""

    cause: str | None
    """Known cause; None without one."""


@dataclass(frozen=True)
class HandCount:
    """Hands of relaxed arms [m/s]."""

    runs: int
    above: int
    """Number of runs with a hand above the allowed speed."""

    max: float | None

    @classmethod
    def of(cls, speeds: Sequence[float]) -> "HandCount":
        """Count these hand speeds."""
        above = sum(speed > HAND_MAX_M_S for speed in speeds)
        return cls(len(speeds), above, round(max(speeds), 3) if speeds else None)


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
    """Scenarios with two or more faults at the same time, judged by the sum of their budgets."""

    runs: int
    missed: int


@dataclass(frozen=True)
class HandFigures:
    """Hand speeds of relaxed arms in runs with one fault, while the wearer does not push [m/s]."""

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
    unexplained: Sequence[str]
    beyond: Mapping[str, float | None]
    """Missed figures by measure; None for a fault that was not found in time."""

    false_trip: bool
    diverged: bool
    hand_m_s: float
    pushed_hand_m_s: float
    flight_hand_m_s: float
    extra_speed_rad_s: float
    extra_way_deg: float
    drift_deg_s: float
    power_W: float
    injected_J: float
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
    diverged: int
    """Number of scenarios in which the simulation diverged; each is also among `crashed`."""

    missed_budgets: int
    """Number of faults with a missed criterion, over all scenarios."""

    unexplained_misses: int
    """Number of these misses without a known cause."""

    missed: list[str]
    """First scenarios with an unexplained miss."""

    by_fault: Mapping[str, FaultFigures | StrikeFigures | GuardEndFigures]
    false_trips: list[str]
    false_trips_per_hour: float
    false_trips_per_hour_at_most: float | None
    """Upper 95 % bound of the rate, for Poisson events; None without any quiet time."""

    quiet_hours: float
    drift_messages: int
    """Messages of the drift monitor before the first fault."""

    pairs: PairFigures
    relaxed_hand_m_s: HandFigures
    """Hands after a stop."""

    relaxed_hand_every_flight_m_s: HandFigures
    """Hands in all flights, stopped or not, from the first onset on."""

    seed: int
    disturbance_level: int
    world: str
    through: str | None
    proved_by: Mapping[str, Sequence[str]] = field(
        default_factory=lambda: {row.id: row.proved_by for row in TESTED_FAULTS}
    )
    """Tests that show a fault without a scenario, by the identifier of the fault, such as F19."""

    flown_by: Mapping[str, Sequence[str]] = field(
        default_factory=lambda: {
            row.id: [f"exograv dev process-faults --only {cell}" for cell in row.cells]
            for row in TESTED_FAULTS
            if row.cells
        }
    )
    """Commands by identifier that fly a fault at real processes."""

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
            unexplained_misses=self.unexplained_misses + missed,
            by_fault={**self.by_fault, **found.by_fault},
            live=found.live,
        )
