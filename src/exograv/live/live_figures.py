"""What `exograv live` writes of a run: timing, recording, stops, and the arm that was learned."""

from typing import Any

import numpy as np

from exograv.procedures.identification.controller_knowledge import ControllerKnowledge
from exograv.procedures.identification.simulated_wearer import SimulatedWearer
from exograv.runtime.clock.timing import Timing

from .live_processes import LiveResult

STALL_BEFORE_S = 0.05
"""A latch is put down to the longest gap so long before it."""


def flown_figures(rig: str, flown: LiveResult) -> dict[str, Any]:
    """Timing, recording and stops."""
    report, recording, timing = flown.report, flown.recording, flown.report.timing
    p50, p99, p999 = (1e-3 * np.percentile(timing.lateness_ns, [50, 99, 99.9])).round(1).tolist()
    return {
        "rig": rig,
        "seconds": round(timing.seconds, 3),
        "outcome": timing.outcome.value,
        "rate_Hz": round(timing.effective_rate_Hz, 3),
        "late_us": {"p50": p50, "p99": p99, "p999": p999, "max": round(1e-3 * float(timing.lateness_ns.max()), 1)},
        "overruns": timing.missed,
        "unanswered": report.unanswered,
        "ticks": len(timing.period),
        "samples_recorded": recording.acknowledged,
        "samples_lost": recording.lost,
        "recording_ok": recording.recording_ok,
        "recording_why": recording.why,
        "recorder_restarts": recording.restarts,
        "unpublished": recording.unpublished,
        "control_restarts": flown.control_restarts,
        "recording": str(flown.path),
        "footprint": dict(flown.footprint),
        "granted": report.rights.granted,
        "refused": report.rights.refused,
        "latches": [
            {"cause": latch.cause, "at_s": round(latch.at_s, 3), "stall_ms": round(stall_ms(timing, latch.period), 3)}
            for latch in report.latches
        ],
        "modes": [{"mode": name, "at_s": round(at_s, 3)} for name, at_s in report.modes],
        "wall_s": round(flown.wall_s, 2),
    }


def learned_figures(flown: LiveResult, wearer: SimulatedWearer | None, prepared: ControllerKnowledge) -> dict[str, Any]:
    """What became of an arm that was to be learned live; with the truth beside it where there is one."""
    learned = flown.learned
    figures: dict[str, Any] = {"findings": flown.findings, "worker_restarts": flown.worker_restarts}
    if learned is None:
        return {"identified": None, **figures}
    left_over = None if wearer is None else wearer.left_over_Nm(prepared, learned.estimate.x)
    return figures | {
        "identified": {
            "outcome": learned.outcome.value,
            "why": learned.why,
            "motion_s": round(learned.estimate.t, 2),
            "stop_s": learned.stop_s,
            "not_relaxed_s": learned.restless_s,
            "left_over_Nm": left_over,
        }
    }


def stall_ms(timing: Timing, period: int) -> float:
    """The longest time without a command shortly before a period: what the computer was not there for."""
    commands = 1e-6 * (timing.period * timing.period_ns + timing.command_ns)
    ended = timing.period <= period + 1
    begun = timing.period >= period - STALL_BEFORE_S * 1e9 / timing.period_ns
    return float(np.diff(commands[ended & begun]).max(initial=0.0))
