"""Supervisor of the recorder: ticks in shared memory reach the disk even if the recorder or control is killed.

Control puts ticks and events into two rings and never waits. Every `SYNC_EVERY_S` the recorder takes them, writes them,
syncs the disk, and only then frees their slots. If it is killed, the next recorder continues the same file, after the
data in it. If the disk fails, the recorder stops for good and reports it; control goes on.
"""

import contextlib
import dataclasses
import signal
import threading
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from exograv.errors import RecordingError
from exograv.recording.disk import TICKS_PER_S, refuse_small_disk
from exograv.recording.encoding import tick_dtype
from exograv.recording.messages import TimingMessage
from exograv.recording.writer import SYNC_EVERY_S, encoded
from exograv.runtime.clock.realtime import Rights
from exograv.runtime.clock.timing import EDGES_US, Timing
from exograv.runtime.lsl.blocks import RecordedDevices
from exograv.runtime.lsl.library import require_lsl
from exograv.runtime.lsl.outlets import OutletsJob
from exograv.runtime.processes.shared_memory import Mailbox, Ring
from exograv.runtime.processes.supervisor import Supervisor

from .recorder_process import (
    EVENT,
    GAVE_UP,
    RING_EVENTS,
    RING_GUARDS,
    RING_TICKS,
    STATUS,
    Inlet,
    RecorderJob,
    RunEnd,
    guard_dtype,
    record,
)

TICKS_WAITING_MAX = TICKS_PER_S
"""Number of unwritten ticks above which the disk is slow; the alarm comes in 1 s (docs/explanation/safety.md, F19)."""

HANGS_S = 10.0
"""Time without a further tick on the disk, while ticks wait, after which a recorder that is alive is replaced [s].

A slow disk rarely takes longer for a sync, and the ring holds more than that.
"""

FRUITLESS_MAX = 3
"""Recorders in a row that may end without one tick on disk; the cause would stop the next one too."""

START_MAX_S = 60.0
"""Time for a fresh interpreter to start [s]; at a load of 20 on two processors some take more than 20 s."""

START_AGAIN_MAX_S = 20.0
"""Time for a further recorder to start [s]: ticks already wait in the ring."""

END_MAX_S = 30.0
"""Time for the rest of the ring to reach a slow disk [s]."""


@dataclass(frozen=True)
class RecorderReport:
    """State of the recording."""

    acknowledged: int
    """Number of ticks on the disk, which survive a killed process and a power failure."""

    waiting: int
    """Number of ticks on their way to the disk."""

    lost: int
    """Number of ticks that found the ring full."""

    restarts: int
    """Number of recorders that were replaced."""

    sync_us_max: float
    """Longest wait of the present recorder for the disk [µs]."""

    why: str
    """Fault, and what to do; empty if there is none."""

    unpublished: str = ""
    """Reason why streams are not published, or those of devices not recorded, any more; empty without a fault."""

    @property
    def recording_ok(self) -> bool:
        """True if each tick is on the disk or waits to be written."""
        return not self.why


class Recorder:
    """Supervisor of the recorder process. `with Recorder(...) as recorder:` completes the file.

    Create it before taking real-time rights, which a child process inherits, and in a process that may wait: the start
    of another recorder takes some milliseconds. The loop has only the `inlet`.
    """

    def __init__(
        self,
        path: Path,
        joints: Sequence[str],
        settings: Mapping[str, Any],
        expected_s: float,
        sync_every_s: float = SYNC_EVERY_S,
        outlets: OutletsJob | None = None,
        devices: RecordedDevices | None = None,
    ):
        """Begin the recording; return when its settings are on the disk.

        Args:
            path: File to create, or to replace.
            joints: Actuated joints, in the order of each per-joint array.
            settings: Message of `/settings`, without `schema_version` and `joints`.
            expected_s: Longest expected run; the disk must have room for twice of it.
            sync_every_s: Time between two syncs of the disk.
            outlets: Streams to publish; None for none.
            devices: Devices to record; None for none. Their messages of `/stream` come by `write`.

        Raises:
            ConfigError: Streams are to be published, and LSL is not installed.
            RecordingError: The disk is too full, or the recorder cannot start.
        """
        if outlets is not None:
            require_lsl()
        path = Path(path)
        refuse_small_disk(path, len(joints), expected_s)
        with contextlib.suppress(OSError):  # then the recorder reports why it cannot write
            path.unlink(missing_ok=True)  # a later recorder must only continue a file of this run
        self._ticks = Ring(tick_dtype(len(joints)), RING_TICKS)
        self._events = Ring(EVENT, RING_EVENTS)
        self._status = Mailbox(STATUS)
        self._guards = Ring(guard_dtype(len(joints)), RING_GUARDS)
        self.inlet = Inlet(len(joints), self._ticks.name, self._events.name, self._guards.name)
        self._job = RecorderJob(
            path, tuple(joints), dict(settings), self.inlet, self._status.name, 1, sync_every_s, outlets, devices
        )
        self._failure, self._safe_at_start = "", 0
        self._safe: int = 0
        self._stuck_since_s: float | None = None
        self._messages: list[tuple[str, float, dict[str, Any]]] = []
        self._one_at_a_time = threading.RLock()
        self._child = Supervisor("recorder", record, self._job, FRUITLESS_MAX - 1)
        self._await_start()

    @property
    def path(self) -> Path:
        """Path of the recording."""
        return self._job.path

    @property
    def pid(self) -> int:
        """Process identifier of the recorder."""
        return self._child.pid

    def offered(self) -> int:
        """Return the number of ticks of the loop so far, with those that found the ring full."""
        return self._ticks.written + self._ticks.lost

    @property
    def failure(self) -> str:
        """Reason why no more data can be written; empty if all is well. Reading it has no effect."""
        return self._failure or self._said("why").decode()

    def check(self) -> RecorderReport:
        """Start another recorder if it has died, and return the state. Call it several times per second."""
        self._failure = self.failure
        self._child.flush()
        if not self._failure and not self._child.is_alive:
            self._replace()
        self._end_hanging()
        return self._report()

    def _end_hanging(self, is_completing: bool = False) -> None:
        """Kill a recorder that writes nothing although ticks, or the end of the file, wait. It is replaced later."""
        safe, now = self._ticks.acknowledged, time.monotonic()
        if safe != self._safe or (safe == self._ticks.written and not is_completing):
            self._safe, self._stuck_since_s = safe, None
        elif self._stuck_since_s is None:
            self._stuck_since_s = now
        elif now - self._stuck_since_s > (HANGS_S if self._has_started else START_AGAIN_MAX_S):
            self._stuck_since_s = None
            self._child.kill()

    @property
    def _has_started(self) -> bool:
        """True if the present recorder has said its status."""
        return int(self._said("start")) == self._child.restarts + 1

    def write(self, topic: str, t: float, message: Mapping[str, Any]) -> None:
        """Have an occasional message of the time `t` [s] recorded, also across a replacement of the recorder.

        Thread-safe.

        Raises:
            RecordingError: The message does not fit the recording format. Nothing is recorded: the recorder would end
                at it, and each further recorder, too.
        """
        encoded(topic, t, message)
        with self._one_at_a_time:
            self._messages.append((topic, t, dict(message)))
            self._child.send(self._messages[-1])

    def finish(self, timing: TimingMessage | None = None) -> RecorderReport:
        """Complete the file after control's last tick.

        Args:
            timing: Result of `timing_message`; lost ticks and restarts are added to it.
        """
        until = time.monotonic() + END_MAX_S
        self._say_end(timing)
        while not self._failure and self._child.exit_status != 0:
            if self._child.await_exit(0.1):
                self._replace()
                self._say_end(timing)
            self._end_hanging(is_completing=True)
            if time.monotonic() > until:
                self._child.kill()
                self._failure = (
                    f"The recorder did not complete {self._job.path} within {END_MAX_S:g} s. The file can be read as "
                    "far as it goes; check whether its disk still works."
                )
        return self._report()

    def close(self) -> None:
        """Complete the file, if that has not happened, and release the shared memory."""
        self.finish()
        self._child.hang_up(1.0)
        for memory in (self._ticks, self._events, self._guards, self._status):
            memory.close()

    def __enter__(self) -> "Recorder":
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _replace(self) -> None:
        code = self._child.exit_status
        if code == GAVE_UP:
            self._failure = self._said("why").decode()
            return
        is_fruitless = code != -getattr(signal, "SIGKILL", 9) and self._ticks.acknowledged == self._safe_at_start
        if not self._start_another(is_fruitless):
            self._failure = (
                f"{FRUITLESS_MAX} recorders in a row ended by themselves (exit code {code}) and wrote nothing to "
                f"{self._job.path}. Their last messages are on this terminal; please report them."
            )

    def _start_another(self, is_fruitless: bool) -> bool:
        safe, job = self._ticks.acknowledged, dataclasses.replace(self._job, start=self._child.restarts + 2)
        with self._one_at_a_time:
            if not self._child.replace(job, is_fruitless):
                return False
            self._safe_at_start = safe
            for message in self._messages:  # the recorder leaves out messages that its file holds already
                self._child.send(message)
        return True

    def _await_start(self) -> None:
        until = time.monotonic() + START_MAX_S
        while self._status.read() is None and not self._failure and time.monotonic() < until:
            if self._child.await_exit(0.02) is not None:
                self._replace()
        if self._status.read() is None:
            self._failure = self._failure or f"The recorder did not start within {START_MAX_S:g} s."
        if why := self.check().why:
            self.close()
            raise RecordingError(why)

    def _say_end(self, timing: TimingMessage | None) -> None:
        counts = {"ticks_lost": self._ticks.lost, "recorder_restarts": self._child.restarts}
        self._child.send(RunEnd(None if timing is None else dataclasses.replace(timing, **counts)))

    def _report(self) -> RecorderReport:
        safe, lost, why = self._ticks.acknowledged, self._ticks.lost, self._failure
        waiting, restarts = self._ticks.written - safe, self._child.restarts
        if not why and lost:
            why = f"{lost} ticks are missing in {self._job.path}: its disk or its recorder stood still for too long."
        if not why and waiting > TICKS_WAITING_MAX:
            why = f"{waiting} ticks wait for the disk of {self._job.path}. Stop what else writes to it."
        unpublished = self._said("unpublished").decode()
        return RecorderReport(safe, waiting, lost, restarts, float(self._said("sync_us_max")), why, unpublished)

    def _said(self, name: str) -> Any:
        """Return a field of the recorder's last status; of an empty entry if there is none."""
        said = self._status.read()
        return np.zeros(1, STATUS)[0][name] if said is None else said[1][name]


def timing_message(t: float, timing: Timing, rights: Rights) -> TimingMessage:
    """Message of `/timing` for a run that ended at `t` [s]."""
    return TimingMessage(
        t,
        timing.periods,
        timing.missed,
        list(EDGES_US),
        timing.histogram(),
        timing.longest_gap_us,
        rights.granted,
        rights.refused,
    )
