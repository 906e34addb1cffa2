"""What a campaign found, in numbers."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from exograv.safety.guard import SafeState

from .driver_faults import ALL, injected_by
from .fault_table import FAULTS, Fault
from .fault_tests import TESTED_FAULTS, UNTESTED_FAULTS
from .scenario import HAND_MAX_M_S, ScenarioVerdict, is_bad


def figures_of(verdicts: Sequence[ScenarioVerdict], faults: Mapping[str, Fault] = FAULTS) -> dict[str, Any]:
    """Of all scenarios, by the contract of `exograv faults --json`."""
    quiet_h = sum(v.quiet_s for v in verdicts) / 3600.0
    false = [v for v in verdicts if v.false_trip]
    return {
        "ok": not any(map(is_bad, verdicts)),
        "scenarios": len(verdicts),
        "ticks": sum(v.course.ticks for v in verdicts),
        "envelope_violations": sum(v.course.violated_ticks for v in verdicts),
        "violations": [f"{v.scenario.command}: {v.course.violations[0]}" for v in verdicts if v.course.violations][:10],
        "crashed": [f"{v.scenario.command}: {v.course.crashed}" for v in verdicts if v.course.crashed][:10],
        "missed_budgets": sum(len(v.missed) for v in verdicts),
        "missed": [f"{v.scenario.command}: {v.found}" for v in verdicts if v.missed][:10],
        "by_fault": {name: _of_fault(name, verdicts) for name in faults},
        "false_trips": [f"{v.scenario.command}: {v.course.reason}" for v in false],
        "false_trips_per_hour": round(len(false) / quiet_h, 2) if quiet_h else 0.0,
        "quiet_hours": round(quiet_h, 4),
        "pairs": _pairs(verdicts),
        "relaxed_hand_m_s": _hand(verdicts),
    }


def _of_fault(name: str, verdicts: Sequence[ScenarioVerdict]) -> dict[str, Any]:
    alone = [v for v in verdicts if v.scenario.faults == (name,) and not v.false_trip]
    times = [t for v in alone if (t := v.found.get(name)) is not None]
    p50, p99, most = np.percentile(times, [50, 99, 100]).round(2).tolist() if times else (None, None, None)
    fault, hands = ALL[name], [v.course.hand_m_s for v in alone if v.relaxed and _is_stopped(v)]
    pushed = max((v.course.pushed_hand_m_s for v in alone), default=0.0)
    return {
        "what": fault.what,
        "injected_by": injected_by(name),
        "runs": sum(name in v.scenario.faults for v in verdicts),
        "alone": len(alone),
        "detected": len(times),
        "reaction_ms": {"p50": p50, "p99": p99, "max": most},
        "budget_ms": fault.budget_ms,
        "missed": sum(name in v.missed for v in verdicts),
        "safe_state": "DRIVES BRAKE" if fault.at_drive else fault.safe_state.name,
        "worst_safe_state": max((v.course.worst for v in alone), default=SafeState.NONE).name,
        "hand_m_s": round(max(hands), 3) if hands else None,
        "pushed_hand_m_s": round(pushed, 3) if pushed else None,
        "extra_speed_rad_s": round(max((v.course.extra_speed for v in alone), default=0.0), 3),
        "extra_way_deg": round(max((v.course.extra_way_deg for v in alone), default=0.0), 2),
    }


def _hand(verdicts: Sequence[ScenarioVerdict]) -> dict[str, Any]:
    """Of relaxed arms after one fault that stopped the run, while nobody pushes."""
    single = [v for v in verdicts if v.relaxed and len(v.scenario.faults) == 1]
    found = [v for v in single if _is_stopped(v)]
    speeds = [v.course.hand_m_s for v in found]
    return {
        "runs": len(speeds),
        "max": round(max(speeds), 3) if speeds else None,
        "above": sum(speed > HAND_MAX_M_S for speed in speeds),
        "allowed": HAND_MAX_M_S,
        "cases": [
            f"{v.scenario.command}: {v.course.hand_m_s:.2f} m/s" for v in found if v.course.hand_m_s > HAND_MAX_M_S
        ],
    }


def _is_stopped(verdict: ScenarioVerdict) -> bool:
    """By the guard or by the drives; the hand of nobody else has been watched."""
    return verdict.course.stopped_tick is not None or verdict.course.braked_tick is not None


def told(verdict: ScenarioVerdict) -> dict[str, Any]:
    """What happened in one scenario."""
    course = verdict.course
    return {
        "ticks": course.ticks,
        "stopped_tick": course.stopped_tick,
        "braked_tick": course.braked_tick,
        "reason": None if course.reason is None else course.reason.value,
        "worst_safe_state": course.worst.name,
        "violations": course.violations,
        "crashed": course.crashed,
        "found_ms": verdict.found,
        "missed": list(verdict.missed),
        "false_trip": verdict.false_trip,
        "hand_m_s": round(course.hand_m_s, 3),
        "pushed_hand_m_s": round(course.pushed_hand_m_s, 3),
        "extra_speed_rad_s": round(course.extra_speed, 3),
        "extra_way_deg": round(course.extra_way_deg, 2),
        "torque_step_Nm": round(course.torque_step_Nm, 4),
        "relaxed": verdict.relaxed,
    }


def _pairs(verdicts: Sequence[ScenarioVerdict]) -> dict[str, int]:
    """Of two faults at a time; judged by the sum of their budgets."""
    pairs = [v for v in verdicts if len(v.scenario.faults) == 2 and not v.false_trip]
    return {"runs": len(pairs), "missed": sum(bool(v.missed) for v in pairs)}


def with_strikes(figures: dict[str, Any], live: dict[str, Any] | None) -> dict[str, Any]:
    """The same with what was found on real processes, where any were struck; the figures of scenarios stay theirs."""
    elsewhere = {"proved_by": {row.id: list(row.proved_by) for row in TESTED_FAULTS}, "not_yet": dict(UNTESTED_FAULTS)}
    if live is None:
        return figures | elsewhere | {"live": None}
    missed = sum(row["missed"] for row in live["by_fault"].values())
    return (
        figures
        | elsewhere
        | {
            "ok": figures["ok"] and not (missed or live["envelope_violations"]),
            "envelope_violations": figures["envelope_violations"] + live["envelope_violations"],
            "violations": [*figures["violations"], *live["violations"]],
            "missed_budgets": figures["missed_budgets"] + missed,
            "by_fault": figures["by_fault"] | live["by_fault"],
            "live": {name: value for name, value in live.items() if name not in ("by_fault", "violations")},
        }
    )
