"""Real-time rights of this process: taken as far as the system grants them, and always returned."""

import gc
import os
import sys
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

from exograv.runtime.clock.free_memory import return_free_memory

from .memory_lock import c_function as _libc
from .memory_lock import lock_memory

if TYPE_CHECKING or sys.platform.startswith("linux"):
    import resource  # not on Windows

PRIORITY = 50
"""Priority of SCHED_FIFO, 1 to 99: above all ordinary processes, as in ros2_control (control.ros.org, Determinism)."""

GUARD_PRIORITY = PRIORITY + 10
"""Priority of the guard: above control, so that a control in an endless loop does not delay it."""

AWAKE_MAX_US, CONTROL_AWAKE_MAX_US = 500_000, 100_000
"""Processor time without a sleep after which the kernel ends a process, and control, by SIGXCPU (RLIMIT_RTTIME) [µs].

A real-time process in an endless loop takes its processor from all ordinary processes until then. Control has the lower
limit from its first tick on; its preparation takes longer. For the guard the limit is the last resort: its loop gives
up before.
"""

CONTAINER = "in a container start it with"


@dataclass
class Rights:
    """Rights that were granted and refused."""

    is_fifo: bool = False
    """True if SCHED_FIFO is in force: only interrupts and higher priorities come before the loop."""

    is_locked: bool = False
    """True if memory in use stays in RAM, so that no page of the loop comes from a disk (`memory_lock`)."""

    granted: list[str] = field(default_factory=list)
    """Granted rights, in a few words each."""

    refused: list[str] = field(default_factory=list)
    """Refused rights, one sentence each: right, reason, and what to do."""


@contextmanager
def realtime(cpu: int, priority: int = PRIORITY) -> Iterator[Rights]:
    """Take one processor, switch the garbage collector off, lock memory and ask for SCHED_FIFO, for the calling thread.

    A refused right is noted and does not stop the others. On leaving, in any way, all is as before.

    Args:
        cpu: Processor, see `host.loop_cpus`.
        priority: Priority of SCHED_FIFO.
    """
    rights = Rights()
    with ExitStack() as undo:
        if not sys.platform.startswith("linux"):
            rights.refused.append(f"Real-time rights need Linux, and this is {sys.platform}: the loop is not punctual.")
            _stop_garbage_collector(rights, undo)
            yield rights
            return
        # The scheduler is set last and reset first, so no part of the set-up runs at real-time priority. The processor
        # is taken just before: the slow set-up would wait for real-time processes that are there already.
        _stop_garbage_collector(rights, undo)
        _lock_memory(rights, undo)
        _take_cpu(rights, undo, cpu)
        _schedule_fifo(rights, undo, priority)
        yield rights


def limit_awake(most_us: int) -> None:
    """Have the kernel end this process after so much processor time without a sleep in real time [µs]."""
    if sys.platform.startswith("linux"):
        soft, hard = resource.getrlimit(resource.RLIMIT_RTTIME)
        stated = [limit for limit in (soft, hard) if limit != resource.RLIM_INFINITY]
        resource.setrlimit(resource.RLIMIT_RTTIME, (min([most_us, *stated]), hard))


# Each function registers its undo before the step: an interrupt between the two leaves no change behind.


def _take_cpu(rights: Rights, undo: ExitStack, cpu: int) -> None:
    before = os.sched_getaffinity(0)
    undo.callback(os.sched_setaffinity, 0, before)
    text = f"Processor {cpu} is refused ({{reason}}): allow it to this process, {CONTAINER} --cpuset-cpus={cpu}."
    _try(rights, f"processor {cpu}", text, lambda: os.sched_setaffinity(0, {cpu}))


def _stop_garbage_collector(rights: Rights, undo: ExitStack) -> None:
    if gc.isenabled():
        undo.callback(gc.enable)
    if gc.get_freeze_count() == 0:
        undo.callback(gc.unfreeze)
    gc.collect()
    gc.freeze()
    gc.disable()
    rights.granted.append("garbage collector off")


def _lock_memory(rights: Rights, undo: ExitStack) -> None:
    return_free_memory()
    if _locked_kB() == 0:
        undo.callback(_libc("munlockall"))
    text = (
        "Locked memory is refused ({reason}): set '@realtime - memlock unlimited' in /etc/security/limits.conf, "
        f"join that group and log in again; {CONTAINER} --ulimit memlock=-1."
    )
    rights.is_locked = _try(rights, "memory locked", text, lambda: lock_memory(_libc))


def _schedule_fifo(rights: Rights, undo: ExitStack, priority: int) -> None:
    soft, hard = resource.getrlimit(resource.RLIMIT_RTTIME)
    undo.callback(resource.setrlimit, resource.RLIMIT_RTTIME, (soft, hard))
    undo.callback(os.sched_setscheduler, 0, os.sched_getscheduler(0), os.sched_getparam(0))
    limit_awake(AWAKE_MAX_US)
    text = (
        "Real-time scheduling is refused ({reason}): set '@realtime - rtprio 99' in /etc/security/limits.conf, "
        f"join that group and log in again; {CONTAINER} --cap-add=sys_nice --ulimit rtprio=99."
    )
    rights.is_fifo = _try(
        rights,
        f"SCHED_FIFO {priority}",
        text,
        lambda: os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(priority)),
    )


def _try(rights: Rights, name: str, refusal: str, act: Callable[[], object]) -> bool:
    """Try to get a right, note the result, and return True if it was granted."""
    try:
        act()
    except OSError as error:
        rights.refused.append(refusal.format(reason=error.strerror))
        return False
    rights.granted.append(name)
    return True


def _locked_kB() -> int:
    """Memory that is already locked [kB]."""
    lines = Path("/proc/self/status").read_text(encoding="utf-8").splitlines()
    return next((int(line.split()[1]) for line in lines if line.startswith("VmLck:")), 0)
