"""`exograv live`: the arm floats in real time, guard, control and recorder in processes of their own, on the twin."""

import contextlib
import multiprocessing
import sys
import time
from collections.abc import Callable, Iterator
from dataclasses import asdict, dataclass
from functools import partial
from multiprocessing.connection import Connection
from multiprocessing.process import BaseProcess
from pathlib import Path
from typing import Any

import numpy as np

from exograv.errors import ConfigError, RigError
from exograv.model.description import Side
from exograv.rig.twin.twin import PERIOD
from exograv.runtime.exchange import answer_dtype, state_dtype
from exograv.runtime.live import (
    Channels,
    ControlJob,
    GuardJob,
    GuardReport,
    control_process,
    guard_process,
)
from exograv.runtime.recorder import Recorder, Report, timing_message
from exograv.runtime.shared import Mailbox
from exograv.runtime.timing import PERIOD_NS, Timing

from .account import versions, written_person, written_rig, written_told
from .live_control import SKIPPED, LiveControl, Plan, guarded_rig, notes
from .person_limits import person_limits
from .pilot import Progress
from .prepare import Prepared, prepare
from .virtual import VirtualLaboratory, draw_laboratory, refuse_motorless

READY_MAX_S = 120.0
"""For a process to build what it needs, kernels compiled in it."""

CHECK_S = 0.25
STALL_BEFORE_S = 0.05
"""A latch is put down to the longest gap so long before it."""


@dataclass(frozen=True)
class LiveOptions:
    """What `exograv live` is asked for."""

    rig: str = "recupera_like"
    side: Side | None = None
    level: int = 2
    seed: int = 0
    seconds: float = 10.0
    gravity_level: float = 0.0
    self_test: bool = False
    """Whether the empty twin is tested before; no wearer of it could come to harm without."""

    def __post_init__(self):
        if not 1.0 <= self.seconds <= 7200.0:
            raise ConfigError(f"--seconds is {self.seconds:g}; allowed: 1 to 7200.")
        if not 0.0 <= self.gravity_level <= 1.0:
            raise ConfigError(
                f"--gravity-level is {self.gravity_level:g}; allowed: 0 (weightless) to 1 (Earth). Above 1 the arm is "
                "pushed down: a mode of its own, later."
            )
        if not 0 <= self.level <= 4:
            raise ConfigError(f"--level is {self.level}; allowed: 0 (none) to 4 (a bad day).")
        if self.seed < 0:
            raise ConfigError(f"--seed is {self.seed}; allowed: 0 and above.")
        if not sys.platform.startswith("linux"):
            raise ConfigError(f"exograv live needs Linux, and this is {sys.platform}.")


def run_live(
    options: LiveOptions,
    folder: Path,
    progress: Progress,
    started: Callable[[BaseProcess, BaseProcess, Recorder], object] = lambda *_: None,
) -> dict[str, Any]:
    """Calibrate and identify in lock-step, then float the arm live; the result follows the contract of the command.

    Args:
        options: What is asked for.
        folder: Of the recording.
        progress: Told now and then.
        started: Told the processes of guard and control, and the recorder, when the loop begins.

    Raises:
        ConfigError: An option cannot be used.
        RigError: A process died before the loop began, or the guard in it.
        RecordingError: There is no room for the recording.
    """
    laboratory = draw_laboratory(options.rig, options.side, options.level, options.seed)
    refuse_motorless(laboratory.description)
    prepared = prepare(laboratory, options.seed, progress)
    self_test = _tested(laboratory, prepared, options.seed, progress) if options.self_test else SKIPPED
    limits_of_person = person_limits(prepared.assembly, prepared.machine, prepared.x)
    plan = Plan(laboratory, prepared, limits_of_person, options.seed, options.gravity_level)
    joints = laboratory.description.joints
    settings = _settings(options, plan)
    path = folder / "live.mcap"
    with Recorder(path, joints, settings, options.seconds) as recorder, _memory(len(joints)) as (states, answers):
        channels = Channels(len(joints), states.name, answers.name, recorder.inlet)
        report, wall_s = _fly(options, plan, channels, recorder, progress, started)
        recording = recorder.finish(timing_message(report.t, report.timing, report.rights))
    return _figures(options, report, recording, path) | {"self_test": self_test, "wall_s": round(wall_s, 2)}


def _tested(laboratory: VirtualLaboratory, prepared: Prepared, seed: int, progress: Progress) -> str:
    """The self-test of the machine without its wearer.

    Raises:
        RigError: It has not passed.
    """
    from .self_test.run import virtual_subject
    from .self_test.unworn import test_machine

    if prepared.calibration is None:
        raise RigError("The machine was not calibrated, so there is nothing to test it by. Calibrate it first.")
    lengths = laboratory.wearer.lengths_given
    subject = virtual_subject(laboratory.description, laboratory.machine, prepared.calibration, lengths, seed)
    steps, busy_s = test_machine(subject, progress)
    for step in steps:
        if not step.passed:
            raise RigError(f"The self-test has failed ({step.name}). {step.what_to_do}")
    return f"passed: {len(steps)} steps, {busy_s:.0f} s of the machine"


def _settings(options: LiveOptions, plan: Plan) -> dict[str, Any]:
    """What the recording says of the run."""
    description, prepared = plan.laboratory.description, plan.prepared
    return {
        "rig": description.name,
        "title": description.settings.title,
        "side": description.side,
        "command": "exograv live",
        "disturbance_level": options.level,
        "seed": options.seed,
        "gravity_level": options.gravity_level,
        "hashes": {"rig": description.sha256},
        "versions": versions(),
        "settings": {
            "options": asdict(options),
            "rig_files": written_rig(description),
            "told": written_told(plan.laboratory.body, plan.laboratory.wearer.lengths_given),
            "live": {
                "period_s": PERIOD,
                "machine": asdict(prepared.machine),
                "x": prepared.x,
                "person": written_person(plan.person),
            },
        },
    }


@contextlib.contextmanager
def _memory(joints: int) -> Iterator[tuple[Mailbox, Mailbox]]:
    states, answers = Mailbox(state_dtype(joints)), Mailbox(answer_dtype(joints))
    try:
        yield states, answers
    finally:
        states.close()
        answers.close()


def _fly(
    options: LiveOptions,
    plan: Plan,
    channels: Channels,
    recorder: Recorder,
    progress: Progress,
    started: Callable[[BaseProcess, BaseProcess, Recorder], object],
) -> tuple[GuardReport, float]:
    context = multiprocessing.get_context("spawn")
    periods = round(options.seconds * 1e9 / PERIOD_NS)
    guard_job = GuardJob(
        partial(guarded_rig, plan), channels, periods, LiveControl.mode_names, True, notes(options.self_test)
    )
    to_guard, guard_end = context.Pipe()
    to_control, control_end = context.Pipe()
    control_job = ControlJob(partial(LiveControl, plan.prepared, plan.gravity_level), channels)
    guard = context.Process(target=guard_process, args=(guard_job, guard_end), name="guard", daemon=True)
    control = context.Process(target=control_process, args=(control_job, control_end), name="control", daemon=True)
    try:
        for process in (guard, control):
            process.start()
        guard_end.close()
        control_end.close()
        progress("Starting guard and control", 0.0)
        for process, connection in ((control, to_control), (guard, to_guard)):
            _await(process, connection, READY_MAX_S)
        to_guard.send("go")
        begun = time.monotonic()
        started(guard, control, recorder)
        return _watched(guard, to_guard, recorder, options.seconds, progress), time.monotonic() - begun
    finally:
        with contextlib.suppress(OSError):
            to_control.send("over")
        for process in (control, guard):
            process.join(2.0)
            if process.is_alive():
                process.kill()


def _await(process: BaseProcess, connection: Connection, seconds: float) -> Any:
    try:
        if connection.poll(seconds):
            return connection.recv()
    except EOFError:
        pass
    process.join(1.0)
    raise RigError(
        f"The process '{process.name}' was not ready (exit status {process.exitcode}). What it wrote above says why; "
        "then repeat."
    )


def _watched(
    guard: BaseProcess, connection: Connection, recorder: Recorder, seconds: float, progress: Progress
) -> GuardReport:
    """The parent's part while the loop runs; Ctrl-C presses Stop, and the arm comes down before all ends."""
    begun = time.monotonic()
    while True:
        try:
            if connection.poll(CHECK_S):
                return connection.recv()
            recorder.check()
            progress("Floating live", min((time.monotonic() - begun) / seconds, 1.0))
        except KeyboardInterrupt:
            connection.send("stop")
        except EOFError:
            guard.join(1.0)
            raise RigError(
                f"The guard's process died (exit status {guard.exitcode}); the drives' own watchdog brakes the arm."
            ) from None


def _figures(options: LiveOptions, report: GuardReport, recording: Report, path: Path) -> dict[str, Any]:
    timing = report.timing
    p50, p99, p999 = (1e-3 * np.percentile(timing.lateness_ns, [50, 99, 99.9])).round(1).tolist()
    return {
        "rig": options.rig,
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
        "recorder_restarts": recording.restarts,
        "recording": str(path),
        "granted": report.rights.granted,
        "refused": report.rights.refused,
        "latches": [
            {"cause": latch.cause, "at_s": round(latch.at_s, 3), "stall_ms": round(_stall_ms(timing, latch.period), 3)}
            for latch in report.latches
        ],
        "modes": [{"mode": name, "at_s": round(at_s, 3)} for name, at_s in report.modes],
    }


def _stall_ms(timing: Timing, period: int) -> float:
    """The longest time without a command shortly before a period: what the computer was not there for."""
    commands = 1e-6 * (timing.period * timing.period_ns + timing.command_ns)
    ended = timing.period <= period + 1
    begun = timing.period >= period - STALL_BEFORE_S * 1e9 / timing.period_ns
    return float(np.diff(commands[ended & begun]).max(initial=0.0))
