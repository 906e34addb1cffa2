"""Strikes at a live run: its processes are killed, stopped and starved in turn, timed by the machine's own clock."""

import contextlib
import multiprocessing
import os
import signal
import threading
import time
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from types import MappingProxyType

from exograv.live.live_processes import Running
from exograv.runtime.control_loop.exchange import answer_dtype, state_dtype
from exograv.runtime.processes.shared_memory import Mailbox
from exograv.safety.guard import SafeState

CALM_S = 1.5
"""Time without a safe state before the next strike [s], so that each strike is measured alone."""

CALM_WAIT_MAX_S = 40.0
"""Longest wait for the arm to be carried again after a strike [s]: a descent of 3 s, and the build of a new control."""

LOOK_S = 0.02

HANG_S = 1.0
"""Duration of a stopped process [s]: shorter than the time-out for control, far longer than the guard waits."""

SLOW_S, QUICK_S, SLOW_TIMES = 0.3, 0.05, 6
"""Pauses and runs of a recorder in turn [s], and their number. They mimic a disk that takes 300 ms for every sync."""

HOG_S = 3.0
FULL_BYTES = 4096
"""Number of bytes that a full disk still accepts."""

ALARM_WAIT_S = 3.0


@dataclass(frozen=True)
class Strike:
    """Strike that was made; times on CLOCK_MONOTONIC."""

    kind: str
    at_ns: int
    was_calm: bool
    """True if no safe state was in force before. Otherwise the strike is not evaluated."""

    alarm_ms: float | None = None
    """Time until the recording was reported to be in danger [ms]."""


@dataclass(frozen=True)
class StrikeKind:
    """Kind of disturbance of a live run."""

    what: str
    budget_ms: float | None
    """Time allowed from the signal to the guard's first safe command [ms]; None if no descent is required."""

    hit: Callable[[Running], None]


def _kill_control(running: Running) -> None:
    os.kill(running.control.pid, signal.SIGKILL)


def _stand_still(pid: int, seconds: float) -> None:
    os.kill(pid, signal.SIGSTOP)
    try:
        time.sleep(seconds)
    finally:
        with contextlib.suppress(ProcessLookupError):
            os.kill(pid, signal.SIGCONT)


def _kill_recorder(running: Running) -> None:
    os.kill(running.recorder.pid, signal.SIGKILL)


def _slow_disk(running: Running) -> None:
    for _ in range(SLOW_TIMES):
        _stand_still(running.recorder.pid, SLOW_S)
        time.sleep(QUICK_S)


def _full_disk(running: Running) -> None:
    import resource  # Available on Linux only, as `exograv run live` is.

    size = running.recorder.path.stat().st_size + FULL_BYTES
    _, hard = resource.prlimit(running.recorder.pid, resource.RLIMIT_FSIZE)
    resource.prlimit(running.recorder.pid, resource.RLIMIT_FSIZE, (size, hard))


def _hog(running: Running) -> None:
    context = multiprocessing.get_context("spawn")
    hogs = [context.Process(target=_burn, args=(HOG_S,), daemon=True) for _ in range(2 * (os.cpu_count() or 1))]
    for hog in hogs:
        hog.start()
    for hog in hogs:
        hog.join()


def _burn(seconds: float) -> None:
    until = time.monotonic() + seconds
    while time.monotonic() < until:
        pass


KINDS: Mapping[str, StrikeKind] = MappingProxyType(
    {
        "F18 killed": StrikeKind("the recorder is killed (-9)", None, _kill_recorder),
        "F18 hangs": StrikeKind(
            "the recorder stands still for a second", None, lambda r: _stand_still(r.recorder.pid, HANG_S)
        ),
        "F18 slow": StrikeKind(
            "the recorder stands still for 300 ms of every 350, as for a slow disk", None, _slow_disk
        ),
        "F38": StrikeKind("twice as many busy processes as processors, for three seconds", None, _hog),
        "F15 live": StrikeKind(
            "control stands still for a second", 10.0, lambda r: _stand_still(r.control.pid, HANG_S)
        ),
        "F16 live": StrikeKind("control is killed (-9)", 5.0, _kill_control),
        "F19": StrikeKind("the disk is full: the kernel refuses the recorder's writes", None, _full_disk),
    }
)  # fmt: skip
"""Kinds in the order of the strikes. The kind that ends the recording comes last."""


class Striker(threading.Thread):
    """Thread that makes strikes of each kind, waits for a calm run between them, and presses Stop at the end."""

    def __init__(self, running: Running, times: int):
        super().__init__(daemon=True)
        self.made: list[Strike] = []
        self._running, self._times = running, times
        self._over = threading.Event()
        # The thread opens its own mailboxes, because the run may end and free its memory at any time.
        joints = running.recorder.inlet.n_joints
        self._states = Mailbox(state_dtype(joints), running.states.name)
        self._answers = Mailbox(answer_dtype(joints), running.answers.name)

    def run(self) -> None:
        """Strike until all strikes are made or the guard has ended."""
        with contextlib.suppress(OSError), contextlib.closing(self._states), contextlib.closing(self._answers):
            for kind in self._order():
                was_calm = self._await_calm()
                if self._over.is_set():
                    return
                at = time.monotonic_ns()
                KINDS[kind].hit(self._running)
                self.made.append(Strike(kind, at, was_calm, self._alarm_ms(at) if kind == "F19" else None))
            self._await_calm()
            self._running.stop()

    def end(self) -> None:
        """Stop striking. Return after the thread has ended."""
        self._over.set()
        self.join()

    def _order(self) -> Iterator[str]:
        last = "F19"
        for _ in range(self._times):
            yield from (kind for kind in KINDS if kind != last)
        yield last

    def _await_calm(self) -> bool:
        """Wait until the arm has been carried for some time. Return True if it was."""
        until, calm_since = time.monotonic() + CALM_WAIT_MAX_S, time.monotonic()
        while time.monotonic() < until and not self._over.is_set():
            if not self._floats():
                calm_since = time.monotonic()
            if time.monotonic() - calm_since > CALM_S:
                return True
            time.sleep(LOOK_S)
        return False

    def _floats(self) -> bool:
        """Return True if no safe state is in force and the whole arm is carried."""
        told, answered = self._states.read(), self._answers.read()
        if told is None or answered is None:
            return False
        return int(told[1]["safe_state"]) < SafeState.DESCENT and float(answered[1]["arm_share"]) >= 1.0

    def _alarm_ms(self, at_ns: int) -> float | None:
        """Wait for the alarm that the recording is in danger. Return its delay [ms], or None without an alarm."""
        while time.monotonic_ns() - at_ns < 1e9 * ALARM_WAIT_S:
            if self._running.recorder.failure:
                return 1e-6 * (time.monotonic_ns() - at_ns)
            time.sleep(LOOK_S)
        return None
