"""The processes of a live run, as their parent sees them: started, watched, replaced where one may be, ended."""

import contextlib
import os
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from multiprocessing.connection import Connection
from multiprocessing.process import BaseProcess
from pathlib import Path
from typing import Any, Protocol, runtime_checkable

from exograv.errors import RigError
from exograv.runtime.answering import Answering, ControlJob, control_process
from exograv.runtime.exchange import Channels, Led, answer_dtype, state_dtype
from exograv.runtime.live import GuardedRig, GuardJob, GuardReport, guard_process
from exograv.runtime.lsl.listening import Listening
from exograv.runtime.recorder import Recorder, Report, timing_message
from exograv.runtime.ros2.bridging import Bridging
from exograv.runtime.shared import Mailbox
from exograv.runtime.spawn import spawned
from exograv.runtime.timing import PERIOD_NS
from exograv.runtime.worker import WorkerJob

from .account import written_person
from .footprint import Footprint
from .lesson import Learned, Passed
from .pilot import Progress
from .worker_keeper import WorkerKeeper

READY_MAX_S = 120.0
"""For a process to build what it needs, kernels compiled in it."""

CHECK_S = 0.25

HANGS_TICKS = 2000
"""In which the guard asked and nobody answered, after which a control that is alive is ended and replaced; the arm has
long been coming down. Not a time: a guard whose machine says nothing does not ask."""

FRUITLESS_MAX = 3
"""Controls in a row that ended without one answer; what ends them would end the next one too."""


@dataclass(frozen=True)
class Parts:
    """How guard and control build what they work with, in their own processes."""

    guard: Callable[[], GuardedRig]
    control: Callable[[], Answering]

    control_again: Callable[[], Answering]
    """After one that died: a control that carries nothing until the operator has reset and the arm is taken again."""

    mode_names: tuple[str, ...]

    notes: Mapping[str, str] = field(default_factory=dict)
    """What to record besides when a mode begins, by its name."""

    worker: WorkerJob | None = None
    """Where the arm is learned while it is moved; its memory is there already."""

    period_ns: int = PERIOD_NS
    """Of the machine [ns]."""


@dataclass(frozen=True)
class Flown:
    """What is left of a live run."""

    report: GuardReport
    recording: Report
    path: Path
    wall_s: float
    control_restarts: int
    footprint: Mapping[str, Any]
    """As `Footprint.figures`."""
    worker_restarts: int = 0
    findings: int = 0
    learned: Learned | None = None
    passed: Passed | None = None


class ControlKeeper:
    """Control's process, and the next one when it has died or hangs; none of them can leave the guard's latch."""

    def __init__(self, parts: Parts, channels: Channels, states: Mailbox, answers: Mailbox):
        self._parts, self._channels, self._states, self._answers = parts, channels, states, answers
        self.restarts = 0
        self._fruitless = self._seen = self._asked = 0
        self._start(parts.control)

    @property
    def pid(self) -> int:
        """Of the control in charge."""
        return self._process.pid or 0

    def await_ready(self) -> None:
        """Wait until it has built what it needs.

        Raises:
            RigError: It has died.
        """
        await_word(self._process, self._connection)

    def check(self) -> None:
        """Replace it if it has died, or does not answer any more. To be called some times a second."""
        answered, asked = _count(self._answers), _count(self._states)
        if answered != self._seen:
            self._seen, self._asked, self._fruitless = answered, asked, 0
        hangs = answered != self._at_start and asked - self._asked > HANGS_TICKS
        if (self._process.is_alive() and not hangs) or self._fruitless >= FRUITLESS_MAX:
            return
        self._end(0.0)
        self.restarts += 1
        self._fruitless += 1
        self._asked = asked
        self._start(self._parts.control_again)

    def close(self) -> None:
        """Say that it is over."""
        self._end(2.0)

    def _start(self, build: Callable[[], Answering]) -> None:
        job = ControlJob(build, self._channels)
        self._process, self._connection = spawned("control", control_process, job)
        self._at_start = _count(self._answers)

    def _end(self, patience_s: float) -> None:
        with contextlib.suppress(OSError):
            self._connection.send("over")
        self._process.join(patience_s)
        if self._process.is_alive():
            self._process.kill()
            self._process.join(1.0)
        self._connection.close()


def _count(mailbox: Mailbox) -> int:
    newest = mailbox.read()
    return 0 if newest is None else newest[0]


@dataclass(frozen=True)
class Running:
    """What runs, for whoever wants to disturb it."""

    guard: BaseProcess
    control: ControlKeeper
    recorder: Recorder
    states: Mailbox
    """What the guard tells control: among it the safe state in force."""

    answers: Mailbox
    """What control answers: among it how much of the arm is carried."""

    stop: Callable[[], None]
    """Press Stop: the arm comes down, then all ends."""

    worker: WorkerKeeper | None = None


def fly(
    parts: Parts,
    seconds: float,
    recorder: Recorder,
    progress: Progress,
    started: Callable[[Running], object] = lambda *_: None,
    listening: Listening | None = None,
    ros2: Bridging | None = None,
) -> Flown:
    """Guard and control in processes of their own beside the recorder, which is completed.

    Streams of other devices, if there are some, are recorded from when guard and control are ready.

    Raises:
        RigError: A process died before the loop began, or the guard in it.
    """
    joints = recorder.inlet.n_joints
    with _memory(joints) as (states, answers), contextlib.ExitStack() as stack:
        channels = Channels(joints, states.name, answers.name, recorder.inlet)
        periods = round(seconds * 1e9 / parts.period_ns)
        job = GuardJob(parts.guard, channels, periods, parts.mode_names, notes=parts.notes, period_ns=parts.period_ns)
        guard, to_guard = spawned("guard", guard_process, job)
        stack.callback(_end, guard)
        control = ControlKeeper(parts, channels, states, answers)
        stack.callback(control.close)
        worker = None if parts.worker is None else _worker(parts.worker, recorder, to_guard, stack)
        progress("Starting guard and control", 0.0)
        if ros2 is not None:
            stack.callback(ros2.close)
            ros2.begin(recorder, states, to_guard.send)
        control.await_ready()
        await_word(guard, to_guard)
        if worker is not None:
            await_word(worker.process, worker.connection)
        if listening is not None:
            listening.begin(recorder.write)
        to_guard.send("go")
        begun = time.monotonic()
        started(Running(guard, control, recorder, states, answers, lambda: to_guard.send("stop"), worker))
        pids = {"guard": guard, "control": control, "recorder": recorder}
        footprint = Footprint({"session": os.getpid} | {name: partial(_pid, one) for name, one in pids.items()})
        report = _watched(guard, to_guard, (recorder, control, worker, footprint, listening, ros2), progress, seconds)
        wall_s = time.monotonic() - begun
        if worker is not None:
            worker.note()
        if listening is not None:
            listening.finish()
        recording = recorder.finish(timing_message(report.t, report.timing, report.rights))
        flown = Flown(report, recording, recorder.path, wall_s, control.restarts, footprint.figures())
        return flown if worker is None else replace(flown, **worker.figures())


def _worker(job: WorkerJob, recorder: Recorder, to_guard: Connection, stack: contextlib.ExitStack) -> WorkerKeeper:
    findings = job.memory.finding_ring()
    stack.callback(findings.close)

    def accept(word: Learned | Passed) -> None:
        to_guard.send(Led(word.person) if word.is_led else word.person)
        message = {"person": written_person(word.person), "gravity_level": 0.0, "is_driven": word.is_led}
        recorder.write("/control", word.t, {"act": "wear", **message})

    keeper = WorkerKeeper(job, findings, recorder.write, accept)
    stack.callback(keeper.close)
    return keeper


def _pid(process: BaseProcess | ControlKeeper | Recorder) -> int:
    return process.pid or 0


def _end(guard: BaseProcess) -> None:
    guard.join(2.0)
    if guard.is_alive():
        guard.kill()


@contextlib.contextmanager
def _memory(joints: int) -> Iterator[tuple[Mailbox, Mailbox]]:
    states, answers = Mailbox(state_dtype(joints)), Mailbox(answer_dtype(joints))
    try:
        yield states, answers
    finally:
        states.close()
        answers.close()


def await_word(process: BaseProcess, connection: Connection) -> Any:
    """What a process says when it is ready.

    Raises:
        RigError: It has died, or takes too long.
    """
    try:
        if connection.poll(READY_MAX_S):
            return connection.recv()
    except EOFError:
        pass
    process.join(1.0)
    raise RigError(
        f"The process '{process.name}' was not ready (exit status {process.exitcode}). What it wrote above says why; "
        "then repeat."
    )


@runtime_checkable
class Watched(Protocol):
    """What the parent looks after while the loop runs."""

    def check(self) -> object:
        """Look after it; called some times a second."""
        ...


def _watched(
    guard: BaseProcess,
    connection: Connection,
    others: Sequence[Watched | None],
    progress: Progress,
    seconds: float,
) -> GuardReport:
    """The parent's part while the loop runs; Ctrl-C presses Stop, and the arm comes down before all ends."""
    begun = time.monotonic()
    while True:
        try:
            if connection.poll(CHECK_S):
                return connection.recv()
            for other in others:
                if other is not None:
                    other.check()
            progress("Floating live", min((time.monotonic() - begun) / seconds, 1.0))
        except KeyboardInterrupt:
            connection.send("stop")
        except EOFError:
            guard.join(1.0)
            raise RigError(
                f"The guard's process died (exit status {guard.exitcode}); the drives' own watchdog brakes the arm."
            ) from None
