"""Figures of a live run: timing, recording, stops, and the arm that was learned."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from exograv.procedures.identification.carried_figures import CarriedFigures
from exograv.procedures.identification.controller_knowledge import ControllerKnowledge
from exograv.procedures.identification.participant_session import KeptParticipant, NotKept
from exograv.procedures.identification.simulated_wearer import SimulatedWearer
from exograv.results import OPTIONAL
from exograv.runtime.clock.timing import Percentiles, Timing, percentiles_us
from exograv.runtime.lsl.listening import ListenedStream, Listening
from exograv.runtime.ros2.bridging import Ros2Figures
from exograv.runtime.ros2.streaming import Streaming

from .footprint import ProcessFootprint
from .guard_job import GuardReport
from .live_processes import LiveResult

STALL_BEFORE_S = 0.05
"""Time before a latch in which the longest gap between commands is taken as its cause [s]."""


SLOW_SHARE = 0.5
"""Median tick of the guard, as a share of the period, from which a short pause delays the next tick [-]."""


@dataclass(frozen=True)
class LatchFigures:
    """Figures of a stop that stays in force until the operator resets it."""

    cause: str
    at_s: float
    stall_ms: float
    """Longest time without a command shortly before the stop [ms]."""


@dataclass(frozen=True)
class ModeFigures:
    """Beginning of a mode."""

    mode: str
    at_s: float


@dataclass(frozen=True)
class LearnedFigures:
    """Arm that was learned live."""

    outcome: str
    why: str
    motion_s: float
    stop_s: float | None
    not_relaxed_s: float | None
    arm_mass_kg: float | None
    """Mass of the arm by the check against the form; None for a known person, and for a motion below 20 s [kg]."""
    arm_check: str | None
    """Verdict of that check."""
    carried: CarriedFigures
    """Decision to float: part of the estimate that the machine carries."""
    left_over_Nm: list[float] | None
    """Left over by the truth of a simulated wearer, per joint, RMS [N·m]."""


@dataclass(frozen=True)
class LiveFigures:
    """Result of `exograv run live`."""

    rig: str
    seconds: float
    outcome: str
    """Causes of stops, then the end of the loop."""

    rate_Hz: float
    late_us: Percentiles
    overruns: int
    unanswered: int
    ticks: int
    samples_recorded: int
    samples_lost: int
    recording_ok: bool
    recording_why: str
    recorder_restarts: int
    unpublished: str
    control_restarts: int
    recording: Path
    footprint: Mapping[str, ProcessFootprint]
    granted: list[str]
    refused: list[str]
    latches: list[LatchFigures]
    modes: list[ModeFigures]
    wall_s: float
    waited_s: float | None
    """Time for which simulated drives waited for this computer [s]; None for drives with a time of their own."""
    machine: str | None = field(metadata=OPTIONAL)
    """Serial number of a machine on drives."""
    self_test: str
    streams: list[ListenedStream]
    ros2: Ros2Figures | None
    findings: int
    worker_restarts: int
    identified: LearnedFigures | None
    person: KeptParticipant | NotKept | None = field(default=None, metadata=OPTIONAL)
    """File of the arm that was written, or the reason for none; None if none was requested, or no arm was learned."""


def live_figures(
    rig: str,
    flown: LiveResult,
    wearer: SimulatedWearer | None,
    prepared: ControllerKnowledge,
    self_test: str,
    streaming: Streaming,
    listening: Listening | None,
    machine: str | None = None,
) -> LiveFigures:
    """Figures of a run, compared with the truth of a simulated wearer if there is one."""
    report, recording, timing = flown.report, flown.recording, flown.report.timing
    return LiveFigures(
        rig=rig,
        seconds=round(timing.seconds, 3),
        outcome=outcome_of(report),
        rate_Hz=round(timing.effective_rate_Hz, 3),
        late_us=percentiles_us(timing.lateness_ns),
        overruns=timing.missed,
        unanswered=report.unanswered,
        ticks=len(timing.period),
        samples_recorded=recording.acknowledged,
        samples_lost=recording.lost,
        recording_ok=recording.recording_ok,
        recording_why=recording.why,
        recorder_restarts=recording.restarts,
        unpublished=recording.unpublished,
        control_restarts=flown.control_restarts,
        recording=flown.path,
        footprint=flown.footprint,
        granted=report.rights.granted,
        refused=report.rights.refused,
        latches=[
            LatchFigures(latch.cause, round(latch.at_s, 3), round(stall_ms(timing, latch.period), 3))
            for latch in report.latches
        ],
        modes=[ModeFigures(name, round(at_s, 3)) for name, at_s in report.modes],
        wall_s=round(flown.wall_s, 2),
        waited_s=None if timing.waited_ns is None else round(1e-9 * timing.waited_ns, 3),
        machine=machine,
        self_test=self_test,
        streams=[] if listening is None else listening.figures(),
        ros2=None if streaming.ros2 is None else streaming.ros2.figures(),
        findings=flown.findings,
        worker_restarts=flown.worker_restarts,
        identified=_learned(flown, wearer, prepared),
    )


def _learned(flown: LiveResult, wearer: SimulatedWearer | None, prepared: ControllerKnowledge) -> LearnedFigures | None:
    learned = flown.learned
    if learned is None:
        return None
    return LearnedFigures(
        outcome=learned.outcome.value,
        why=learned.why,
        motion_s=round(learned.estimate.t, 2),
        stop_s=learned.stop_s,
        not_relaxed_s=learned.restless_s,
        arm_mass_kg=None if learned.check is None else round(learned.check.arm_mass, 3),
        arm_check=None if learned.check is None else learned.check.why,
        carried=CarriedFigures.of(learned.carried),
        left_over_Nm=None if wearer is None else wearer.left_over_Nm(prepared, learned.carried.x),
    )


def outcome_of(report: GuardReport) -> str:
    """Sentences on the end of a run: first the cause and the time of each stop, then the end of the loop."""
    stops = [f"{latch.cause} The guard stopped the machine after {latch.at_s:.3f} s." for latch in report.latches]
    errors = [report.failure] if report.failure else []
    slow = [slow_ticks_text(report.timing)] if stops else []
    return " ".join([*errors, *stops, *filter(None, slow), report.timing.outcome.value])


def waited_text(waited_s: float) -> str:
    """Sentence on simulated drives that waited for this computer for a time [s]."""
    return (
        f"The simulated drives waited for this computer, {waited_s:.2f} s in total; with --real-time they keep their "
        "own time, as real drives do."
    )


def slow_ticks_text(timing: Timing) -> str:
    """Sentence on a computer whose ticks leave little time before the next one; empty if they leave enough."""
    if len(timing.period) == 0 or timing.waited_ns is not None:
        return ""
    share = float(np.median(timing.command_ns)) / timing.period_ns
    if share < SLOW_SHARE:
        return ""
    return (
        f"A tick of the guard, with its waits for drives and control, took {1e-6 * share * timing.period_ns:.2f} of "
        f"{1e-6 * timing.period_ns:.0f} ms (median): the computer is busy, or too slow for this period. End other "
        "programs, or give a drives.toml with a longer period_ms."
    )


def stall_ms(timing: Timing, period: int) -> float:
    """Longest time without a command shortly before a period [ms]: the computer did not run the loop meanwhile."""
    commands = 1e-6 * (timing.period * timing.period_ns + timing.command_ns)
    ended = timing.period <= period + 1
    begun = timing.period >= period - STALL_BEFORE_S * 1e9 / timing.period_ns
    return float(np.diff(commands[ended & begun]).max(initial=0.0))
