"""Processes of a live run in their parent: start, supervision, replacement where that is safe, and end."""

import contextlib
import os
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import Protocol, runtime_checkable

import numpy as np

from exograv.errors import RigError
from exograv.loop.pilot import Progress
from exograv.loop.replay_log import written_person
from exograv.results import json_value
from exograv.runtime.clock.free_memory import return_free_memory
from exograv.runtime.clock.timing import PERIOD_NS
from exograv.runtime.control_loop.answering import ControlInterface
from exograv.runtime.control_loop.exchange import Channels, PersonUpdate, answer_dtype, state_dtype
from exograv.runtime.control_loop.guard_commands import ENDS, GuardLine
from exograv.runtime.control_loop.worker import WorkerJob
from exograv.runtime.lsl.listening import Listening
from exograv.runtime.processes.shared_memory import Mailbox
from exograv.runtime.processes.supervisor import Supervisor
from exograv.runtime.recorder.recorder import Recorder, RecorderReport, timing_message
from exograv.runtime.ros2.bridging import Bridging

from .arm_worker import LearnedArm, PassesResult
from .control_supervisor import ControlKeeper
from .footprint import Footprint, ProcessFootprint
from .guard_job import LONGEST_DESCENT_S, GuardedRig, GuardJob, GuardReport
from .guard_process import guard_process
from .worker_supervisor import WorkerKeeper

CHECK_S, REPLY_S = 0.25, 0.02
"""Period of the parent's checks, and of its looks for replies of the guard [s]."""

HANGS_S, ENABLES_S = 10.0, 60.0
"""Time without a tick after which a guard hangs, in the loop and before its first tick [s].

The guard may switch drives on before the first tick, and off after the last one, at the pace of the drives.
"""


@dataclass(frozen=True)
class ProcessParts:
    """Functions that build guard, control and worker in their own processes."""

    guard: Callable[[], GuardedRig]
    control: Callable[[], ControlInterface]

    control_again: Callable[[], ControlInterface]
    """Function that builds a new control after a crash.

    It carries nothing until the operator resets the guard and takes the arm.
    """

    mode_names: tuple[str, ...]

    notes: Mapping[str, str] = field(default_factory=dict)
    """Notes to record when a mode begins, by the name of the mode."""

    worker: WorkerJob | None = None
    """Worker of a live identification; its shared memory exists already."""

    period_ns: int = PERIOD_NS
    """Period of the machine [ns]."""

    is_steered: bool = False
    """True if an operator at a page requests each step; otherwise a virtual operator does."""


@dataclass(frozen=True)
class LiveResult:
    """Result of a live run: reports of guard and recorder, restarts, and the identified arm."""

    report: GuardReport
    recording: RecorderReport
    path: Path
    wall_s: float
    control_restarts: int
    footprint: Mapping[str, ProcessFootprint]
    worker_restarts: int = 0
    findings: int = 0
    learned: LearnedArm | None = None
    passed: PassesResult | None = None
    predicted: np.ndarray | None = None
    """Predicted left over per joint after the identification [N·m]; None without one."""


@dataclass(frozen=True)
class Running:
    """Handles of the running processes, for tests and pages."""

    guard: Supervisor[GuardJob]
    control: ControlKeeper
    recorder: Recorder
    states: Mailbox
    """Messages of the guard to control, with the present safe state."""

    answers: Mailbox
    """Answers of control, with the share of the arm that is carried."""

    line: GuardLine
    """Connection to the guard."""

    worker: WorkerKeeper | None = None

    def stop(self) -> None:
        """Press Stop: the machine lowers the arm, then all processes end."""
        self.line.send(ENDS)


def fly(
    parts: ProcessParts,
    seconds: float,
    recorder: Recorder,
    progress: Progress,
    started: Callable[[Running], object] = lambda *_: None,
    listening: Listening | None = None,
    ros2: Bridging | None = None,
    hears: Callable[[object], object] = lambda _: None,
) -> LiveResult:
    """Run guard and control in processes of their own beside the recorder, and complete the recording.

    Streams of other devices are recorded from the moment when guard and control are ready. `hears` is called with each
    message of the guard while the loop runs.

    Raises:
        RigError: A process died before the loop began, or the guard died during the loop.
    """
    joints = recorder.inlet.n_joints
    with _memory(joints) as (states, answers, line), contextlib.ExitStack() as stack:
        channels = Channels(joints, states.name, answers.name, recorder.inlet, line.names)
        job = GuardJob(
            parts.guard, channels, round(seconds * 1e9 / parts.period_ns), parts.mode_names, notes=parts.notes,
            period_ns=parts.period_ns, is_steered=parts.is_steered
        )  # fmt: skip
        guard = Supervisor("guard", guard_process, job)
        stack.callback(_end, guard)
        control = ControlKeeper(parts.control, parts.control_again, channels, states, answers)
        stack.callback(control.close)
        worker = None if parts.worker is None else _worker(parts.worker, recorder, line, stack)
        progress("Starting guard and control", 0.0)
        return_free_memory()  # while the processes prepare
        if ros2 is not None:
            stack.callback(ros2.close)
            ros2.begin(recorder, states, line.send)
        guard.await_ready()
        control.await_ready()
        _note_posture(states, recorder)
        if worker is not None:
            worker.await_ready()
        if listening is not None:
            listening.begin(recorder.write)
        line.beat()
        stack.callback(_let_down, guard, line, recorder)
        guard.send("go")
        begun = time.monotonic()
        started(Running(guard, control, recorder, states, answers, line, worker))
        pids = {"guard": guard, "control": control, "recorder": recorder}
        footprint = Footprint({"session": os.getpid} | {name: partial(_pid, one) for name, one in pids.items()})
        others = (GuardWatch(guard.kill, recorder.offered), recorder, control, worker, footprint, listening, ros2)
        report = _watched(guard, line, others, progress, lambda: recorder.offered() / job.periods, hears)
        wall_s = time.monotonic() - begun
        if worker is not None:
            worker.note()
        if listening is not None:
            listening.finish()
        recording = recorder.finish(timing_message(report.t, report.timing, report.rights))
        flown = LiveResult(report, recording, recorder.path, wall_s, control.restarts, footprint.figures())
        if worker is None:
            return flown
        return replace(
            flown,
            worker_restarts=worker.restarts,
            findings=worker.findings,
            learned=worker.learned,
            passed=worker.passed,
            predicted=None if worker.judged is None else worker.judged.left_over,
        )


def _note_posture(states: Mailbox, recorder: Recorder) -> None:
    """Record the posture for which control has prepared: a replay prepares for it, too."""
    if (shown := states.read()) is not None:
        state = shown[1]
        recorder.write("/control", float(state["now"]), {"act": "prepare", "q": json_value(state["q"])})


def _worker(job: WorkerJob, recorder: Recorder, line: GuardLine, stack: contextlib.ExitStack) -> WorkerKeeper:
    findings = job.memory.finding_ring()
    stack.callback(findings.close)

    def accept(word: LearnedArm | PassesResult) -> None:
        line.send(PersonUpdate(word.person) if word.is_led else word.person)
        message = {"person": written_person(word.person), "gravity_level": 0.0, "is_driven": word.is_led}
        recorder.write("/control", word.t, {"act": "wear", **message})

    keeper = WorkerKeeper(job, findings, recorder.write, accept)
    stack.callback(keeper.close)
    return keeper


def _pid(process: Supervisor[GuardJob] | ControlKeeper | Recorder) -> int:
    return process.pid


def _end(guard: Supervisor[GuardJob]) -> None:
    """End a guard whose motors are off."""
    if guard.await_exit(2.0) is None:
        guard.kill()


def _let_down(guard: Supervisor[GuardJob], line: GuardLine, recorder: Recorder) -> None:
    """Have a guard that still runs let the arm down, and wait for its end. A further Ctrl-C does not shorten this."""
    until = time.monotonic() + LONGEST_DESCENT_S
    with contextlib.suppress(OSError):
        line.send(ENDS)
    watch = GuardWatch(guard.kill, recorder.offered)
    while guard.is_alive and time.monotonic() < until:
        with contextlib.suppress(KeyboardInterrupt):
            line.beat()
            watch.check()
            # The guard ends when its report is read.
            if guard.next_word(CHECK_S) is not None or guard.has_hung_up:
                guard.await_exit(CHECK_S)


@contextlib.contextmanager
def _memory(joints: int) -> Iterator[tuple[Mailbox, Mailbox, GuardLine]]:
    made = Mailbox(state_dtype(joints)), Mailbox(answer_dtype(joints)), GuardLine()
    try:
        yield made
    finally:
        for memory in made:
            memory.close()


@dataclass
class GuardWatch:
    """Check that the guard runs its loop. A guard that hangs is killed; the watchdogs of the drives brake the arm."""

    kill: Callable[[], None]
    """Function that kills the guard."""

    ticks: Callable[[], int]
    """Function that returns the number of ticks of its loop so far."""

    _seen: int = 0
    _changed_s: float = field(default_factory=time.monotonic)

    def check(self) -> None:
        """Kill the guard if its loop has run no tick for too long."""
        now, ticks = time.monotonic(), self.ticks()
        if ticks != self._seen:
            self._seen, self._changed_s = ticks, now
        elif now - self._changed_s > (HANGS_S if ticks else ENABLES_S):
            self.kill()


@runtime_checkable
class WatchedProcesses(Protocol):
    """Process or device that the parent checks while the loop runs."""

    def check(self) -> object:
        """Check the process; called several times a second."""
        ...


def _why_without_report(exit_status: int | None) -> str:
    """Return what has happened to a guard from which no report can come any more."""
    if exit_status in (None, 0):
        return (
            "The report of the guard process cannot be read: it sent bytes that are no message. The guard lowers the "
            "arm before it ends, and the recording holds the run. Please report this."
        )
    return f"The guard process died (exit status {exit_status}). The watchdogs of the drives brake the arm."


def _watched(
    guard: Supervisor[GuardJob],
    line: GuardLine,
    others: Sequence[WatchedProcesses | None],
    progress: Progress,
    done: Callable[[], float],
    hears: Callable[[object], object],
) -> GuardReport:
    """Watch the processes while the loop runs. Ctrl-C presses Stop: the machine lowers the arm before the end.

    `done` returns the share of the ticks so far: the time of drives that wait is not that of the clock.
    """
    checked = time.monotonic()
    while True:
        try:
            word = guard.next_word(REPLY_S)
            if isinstance(word, GuardReport):
                return word
            if guard.has_hung_up:
                raise RigError(_why_without_report(guard.await_exit(1.0)))
            for reply in line.replies():
                hears(reply)
            if (now := time.monotonic()) - checked < CHECK_S:
                continue
            checked = now
            line.beat()
            for other in others:
                if other is not None:
                    other.check()
            progress("Floating live", min(done(), 1.0))
        except KeyboardInterrupt:
            with contextlib.suppress(OSError):  # a guard that takes nothing any more misses the signs of life, too
                line.send(ENDS)
