"""The processes of a live run, as their parent sees them: started, watched, replaced where one may be, ended."""

import contextlib
import os
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import Protocol, runtime_checkable

from exograv.errors import RigError
from exograv.loop.pilot import Progress
from exograv.loop.replay_log import written_person
from exograv.runtime.clock.timing import PERIOD_NS
from exograv.runtime.control_loop.answering import ControlInterface
from exograv.runtime.control_loop.exchange import Channels, PersonUpdate, answer_dtype, state_dtype
from exograv.runtime.control_loop.guard_commands import BELL, ENDS, GuardLine
from exograv.runtime.control_loop.worker import WorkerJob
from exograv.runtime.lsl.listening import Listening
from exograv.runtime.processes.shared_memory import Mailbox
from exograv.runtime.processes.supervisor import Supervisor
from exograv.runtime.recorder.recorder import Recorder, RecorderReport, timing_message
from exograv.runtime.ros2.bridging import Bridging

from .arm_worker import LearnedArm, PassesResult
from .control_supervisor import ControlKeeper
from .footprint import Footprint, ProcessFootprint
from .guard_process import GuardedRig, GuardJob, GuardReport, guard_process
from .worker_supervisor import WorkerKeeper

CHECK_S = 0.25


@dataclass(frozen=True)
class ProcessParts:
    """How guard and control build what they work with, in their own processes."""

    guard: Callable[[], GuardedRig]
    control: Callable[[], ControlInterface]

    control_again: Callable[[], ControlInterface]
    """After one that died: a control that carries nothing until the operator has reset and the arm is taken again."""

    mode_names: tuple[str, ...]

    notes: Mapping[str, str] = field(default_factory=dict)
    """What to record besides when a mode begins, by its name."""

    worker: WorkerJob | None = None
    """Where the arm is learned while it is moved; its memory is there already."""

    period_ns: int = PERIOD_NS
    """Of the machine [ns]."""

    is_steered: bool = False
    """Whether somebody at a page asks for each step; a virtual operator does by itself."""


@dataclass(frozen=True)
class LiveResult:
    """What is left of a live run."""

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


@dataclass(frozen=True)
class Running:
    """What runs, for whoever wants to disturb it."""

    guard: Supervisor[GuardJob]
    control: ControlKeeper
    recorder: Recorder
    states: Mailbox
    """What the guard tells control: among it the safe state in force."""

    answers: Mailbox
    """What control answers: among it how much of the arm is carried."""

    line: GuardLine
    """To the guard."""

    worker: WorkerKeeper | None = None

    def stop(self) -> None:
        """Press Stop: the arm comes down, then all ends."""
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
    """Guard and control in processes of their own beside the recorder, which is completed.

    Streams of other devices, if there are some, are recorded from when guard and control are ready. What the guard
    says while the loop runs, `hears` is told.

    Raises:
        RigError: A process died before the loop began, or the guard in it.
    """
    joints = recorder.inlet.n_joints
    with _memory(joints) as (states, answers, bell), contextlib.ExitStack() as stack:
        channels = Channels(joints, states.name, answers.name, recorder.inlet, bell.name)
        job = GuardJob(
            parts.guard, channels, round(seconds * 1e9 / parts.period_ns), parts.mode_names, notes=parts.notes,
            period_ns=parts.period_ns, is_steered=parts.is_steered
        )  # fmt: skip
        guard = Supervisor("guard", guard_process, job)
        stack.callback(_end, guard)
        line = GuardLine(guard.connection, bell)
        control = ControlKeeper(parts.control, parts.control_again, channels, states, answers)
        stack.callback(control.close)
        worker = None if parts.worker is None else _worker(parts.worker, recorder, line, stack)
        progress("Starting guard and control", 0.0)
        if ros2 is not None:
            stack.callback(ros2.close)
            ros2.begin(recorder, states, line.send)
        control.await_ready()
        guard.await_ready()
        if worker is not None:
            worker.await_ready()
        if listening is not None:
            listening.begin(recorder.write)
        guard.send("go")
        begun = time.monotonic()
        started(Running(guard, control, recorder, states, answers, line, worker))
        pids = {"guard": guard, "control": control, "recorder": recorder}
        footprint = Footprint({"session": os.getpid} | {name: partial(_pid, one) for name, one in pids.items()})
        others = (recorder, control, worker, footprint, listening, ros2)
        report = _watched(guard, line, others, progress, seconds, hears)
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
        )


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
    if guard.await_exit(2.0) is None:
        guard.kill()


@contextlib.contextmanager
def _memory(joints: int) -> Iterator[tuple[Mailbox, Mailbox, Mailbox]]:
    made = Mailbox(state_dtype(joints)), Mailbox(answer_dtype(joints)), Mailbox(BELL)
    try:
        yield made
    finally:
        for mailbox in made:
            mailbox.close()


@runtime_checkable
class WatchedProcesses(Protocol):
    """What the parent looks after while the loop runs."""

    def check(self) -> object:
        """Look after it; called some times a second."""
        ...


def _watched(
    guard: Supervisor[GuardJob],
    line: GuardLine,
    others: Sequence[WatchedProcesses | None],
    progress: Progress,
    seconds: float,
    hears: Callable[[object], object],
) -> GuardReport:
    """The parent's part while the loop runs; Ctrl-C presses Stop, and the arm comes down before all ends."""
    begun = time.monotonic()
    while True:
        try:
            word = guard.next_word(CHECK_S)
            if isinstance(word, GuardReport):
                return word
            if guard.has_hung_up:
                raise RigError(
                    f"The guard's process died (exit status {guard.await_exit(1.0)}); the drives' own watchdog brakes "
                    "the arm."
                )
            if word is not None:
                hears(word)
                continue
            for other in others:
                if other is not None:
                    other.check()
            progress("Floating live", min((time.monotonic() - begun) / seconds, 1.0))
        except KeyboardInterrupt:
            line.send(ENDS)
