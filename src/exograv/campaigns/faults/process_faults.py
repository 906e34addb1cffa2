"""Faults of real processes: a live run under strikes, and the reactions of guard, control and recording."""

import tempfile
import time
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from exograv.errors import RigError
from exograv.live.live_control import LivePlan
from exograv.live.live_figures import stall_ms
from exograv.live.live_flight import fly_plan
from exograv.live.live_processes import LiveResult, Running
from exograv.loop.machine_limits import limits
from exograv.loop.pilot import Progress
from exograv.recording import read_recording
from exograv.runtime.clock.timing import PERIOD_NS, Timing
from exograv.safety.guard import SafeState

from .figures import AroundStrikes, GuardEndFigures, ReactionTimes, StrikeFigures, Strikes, StruckRun
from .oracle import EnvelopeOracle
from .strikes import KINDS, Strike, Striker

SECONDS_A_STRIKE = 60.0
"""Time limit per strike [s], more than any strike takes; a run ends when all strikes are made."""

AROUND_S = 2.0
"""Time before and after a strike in which control's timing is compared [s]."""

FLOATS_AFTER_S = 8.0
"""Time from the loop's start until the arm floats: a rest and a ramp [s]."""

AFTER_MS = 1000.0
"""Time after a strike beyond which a stop has another cause [ms]."""

ALARM_MAX_MS = 1000.0
"""Time allowed from a full disk to the alarm [ms] (docs/explanation/safety.md, F19)."""

ROUNDING_NM = 1e-4
"""Rounding of values recorded with 32 bits, positions through the table included [N·m]."""


def strike(plan: LivePlan, times: int, progress: Progress) -> Strikes:
    """Fly a person live and strike each process `times` times, then kill the guard of another run.

    Raises:
        RigError: A process died without a strike.
        RecordingError: There is no room for the recording.
    """
    strikers: list[Striker] = []

    def started(running: Running) -> None:
        strikers.append(Striker(running, times))
        strikers[0].start()

    with tempfile.TemporaryDirectory() as folder:
        seconds = SECONDS_A_STRIKE * times * len(KINDS)
        try:
            flown = fly_plan(
                plan, seconds, Path(folder) / "live.mcap", {}, _named(progress, "Striking processes"), started
            )
        finally:
            for striker in strikers:
                striker.end()
        made, (live, violations) = strikers[0].made, _recorded(plan, flown)
    rows = {kind: _row(kind, [one for one in made if one.kind == kind], flown, live) for kind in KINDS}
    # A loop that the computer cannot keep up with ends early. Kinds without a valid strike are not proved.
    live = replace(
        live, not_struck=[kind for kind, row in rows.items() if not row.alone], granted=flown.report.rights.granted
    )
    return Strikes(live, {**rows, "F17 live": end_of_guard(plan, progress)}, violations)


def _named(progress: Progress, name: str) -> Progress:
    return lambda _text, share: progress(name, share)


def _recorded(plan: LivePlan, flown: LiveResult) -> tuple[StruckRun, list[str]]:
    """Figures of the run from its recording, and the first commands outside of the envelope."""
    ticks, lost = read_recording(flown.path).ticks, flown.recording.lost
    gaps = np.diff(ticks["sequence"].astype(np.int64)) - 1
    wrong = [what for part in np.split(ticks, np.flatnonzero(gaps) + 1) for what in _judged(plan, part)]
    # Ticks that found the ring buffer full were never acknowledged; ticks in a larger gap were.
    missing = max(flown.recording.acknowledged - len(ticks), 0) + max(int(gaps.sum()) - lost, 0)
    run = StruckRun(
        outcome=flown.report.timing.outcome.value,
        recording=flown.recording.why,
        ticks=len(ticks),
        envelope_violations=len(wrong),
        samples_acknowledged=flown.recording.acknowledged,
        samples_lost=lost,
        acknowledged_missing=missing,
        control_restarts=flown.control_restarts,
        recorder_restarts=flown.recording.restarts,
    )
    return run, [f"live: {what}" for what in wrong[:3]]


def _judged(plan: LivePlan, ticks: np.ndarray) -> list[str]:
    """Return a sentence for each command that violates the envelope."""
    oracle = EnvelopeOracle(limits(plan.description), plan.person, 1e-9 * plan.period_ns, ROUNDING_NM)
    for tau, q in zip(ticks["tau_commanded"].astype(float), ticks["q_measured"].astype(float), strict=True):
        oracle.note(tau, q, frozenset(), plan.gravity_level)
    return [f"{ticks['t'][k]:.3f} s: {what}" for k, what in oracle.judge().wrong.items()]


def _row(kind: str, made: Sequence[Strike], flown: LiveResult, live: StruckRun) -> StrikeFigures:
    row, budget = KINDS[kind], KINDS[kind].budget_ms
    counted = [one for one in made if one.was_calm]
    times = [reaction_ms(one, flown) for one in counted] if budget is not None else []
    seen = [time for time in times if time is not None]
    stalls = [_stall_ms(one, flown) for one in counted] if budget is not None else []
    missed = sum(time is None or time > (budget or 0.0) + stall for time, stall in zip(times, stalls, strict=False))
    if kind == "F19":
        missed = sum(one.alarm_ms is None or one.alarm_ms > ALARM_MAX_MS for one in made)
        seen = [one.alarm_ms for one in made if one.alarm_ms is not None]
    if budget is None:
        missed += live.acknowledged_missing > 0
    return StrikeFigures(
        what=row.what,
        runs=len(made),
        alone=len(counted),
        detected=len(seen),
        reaction_ms=ReactionTimes.of(seen),
        budget_ms=ALARM_MAX_MS if kind == "F19" else budget,
        missed=missed,
        safe_state=(SafeState.DESCENT if budget is not None else SafeState.NONE).name,
        stall_ms=round(max(stalls), 2) if stalls else None,
        command_p999_us=_around(counted, flown),
        acknowledged_missing=live.acknowledged_missing,
    )


def reaction_ms(one: Strike, flown: LiveResult) -> float | None:
    """Time from a strike to the end of the tick in which the guard began the descent [ms]; None if there was none."""
    after = [1e3 * latch.at_s - _ms(one, flown) for latch in flown.report.latches]
    return min((ms for ms in after if 0.0 <= ms < AFTER_MS), default=None)


def _ms(one: Strike, flown: LiveResult) -> float:
    """Time of a strike on the loop's own clock [ms]."""
    return 1e-6 * (one.at_ns - flown.report.started_ns)


def _stall_ms(one: Strike, flown: LiveResult) -> float:
    """Delay of the guard by the computer itself, near the strike [ms]."""
    first = next((latch.period for latch in flown.report.latches if latch.at_s * 1e3 >= _ms(one, flown)), None)
    if first is None:
        return 0.0
    return max(stall_ms(flown.report.timing, first) - 1e-6 * PERIOD_NS, 0.0)


def _around(made: Sequence[Strike], flown: LiveResult) -> AroundStrikes:
    timing = flown.report.timing
    ms = timing.period * 1e-6 * timing.period_ns
    marks = [_ms(one, flown) for one in made]
    before = _any([(mark - 1e3 * AROUND_S <= ms) & (ms < mark) for mark in marks], timing)
    after = _any([(mark <= ms) & (ms < mark + 1e3 * AROUND_S) for mark in marks], timing)
    return AroundStrikes(before, after)


def _any(masks: Sequence[np.ndarray], timing: Timing) -> float | None:
    taken = timing.command_ns[np.logical_or.reduce(masks)] if masks else np.empty(0)
    return round(1e-3 * float(np.percentile(taken, 99.9)), 1) if len(taken) else None


def end_of_guard(plan: LivePlan, progress: Progress) -> GuardEndFigures:
    """Kill the guard (-9) and check that the parent reports it and that the recording is complete.

    The twin's drives end with the process that runs them, so their watchdog is timed in lock-step (F17).
    """
    at_ns = [0]

    def started(running: Running) -> None:
        time.sleep(FLOATS_AFTER_S)
        at_ns[0] = time.monotonic_ns()
        running.guard.kill()

    with tempfile.TemporaryDirectory() as folder:
        try:
            fly_plan(
                plan, SECONDS_A_STRIKE, Path(folder) / "live.mcap", {}, _named(progress, "Killing the guard"), started
            )
            ended = None
        except RigError:
            ended = round(1e-6 * (time.monotonic_ns() - at_ns[0]), 1)
        recording = read_recording(Path(folder) / "live.mcap")
    return GuardEndFigures(
        what="the guard is killed (-9): its parent ends the other processes, completes the recording and reports it",
        runs=1,
        alone=1,
        detected=int(ended is not None),
        reaction_ms=ReactionTimes(),
        ended_ms=ended,
        budget_ms=None,
        missed=int(ended is None or recording.remark is not None),
        safe_state="DRIVES BRAKE",
    )
