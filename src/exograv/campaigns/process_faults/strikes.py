"""Strikes at a session from outside: signals, limits of the kernel, and the signal that wakes a hook."""

import os
import signal
import sys
import time
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING

from exograv.campaigns.faults.strikes import FULL_BYTES

from . import hooks
from .cell import Cell, Fault, Process
from .watching import send_all

if TYPE_CHECKING or sys.platform.startswith("linux"):
    import resource  # not on Windows

SUSPENDED_S = 2.0
"""Duration of a suspend of all processes [s]."""

SIGNALS: Mapping[Fault, str] = MappingProxyType(
    {
        Fault.KILL: "SIGKILL",
        Fault.STOP: "SIGSTOP",
        Fault.HANGUP: "SIGHUP",
        Fault.TERMINATE: "SIGTERM",
        Fault.QUIT: "SIGQUIT",
        Fault.CTRL_Z: "SIGTSTP",
    }
)
"""Names of the signals that are faults by themselves; Windows has few of them."""

IN_HOOK = (Fault.SPIN, Fault.EXCEPTION, Fault.HALF_WORD, Fault.HALF_MESSAGE, Fault.FULL_PIPE)
"""Faults that a hook in a process of the session makes; the hook notes their time."""


@dataclass(frozen=True)
class Target:
    """Running session of the campaign, as a strike sees it from outside."""

    pids: Mapping[str, int]
    """Identifier of each process by name."""
    all_pids: list[int]
    recording: Path


@dataclass(frozen=True)
class Struck:
    """Strike that was made; times on CLOCK_MONOTONIC [s]."""

    t: float
    resumed_t: float | None = None


def strike(cell: Cell, target: Target) -> Struck:
    """Make the strike of a cell. A hook acts a little later, and notes its own time."""
    if cell.fault is Fault.SUSPEND:
        return _suspend(target)
    t = time.monotonic()
    if cell.process is Process.SESSION:
        os.killpg(target.pids[Process.PARENT], getattr(signal, SIGNALS[cell.fault]))
    elif cell.fault in IN_HOOK:
        _wake_hooks(cell, target)
    elif cell.fault is Fault.MEMORY:
        _limit(target.pids[cell.process], resource.RLIMIT_AS, _memory_bytes(target.pids[cell.process]))
    elif cell.fault is Fault.DISK:
        _limit(target.pids[cell.process], resource.RLIMIT_FSIZE, target.recording.stat().st_size + FULL_BYTES)
    else:
        os.kill(target.pids[cell.process], getattr(signal, SIGNALS[cell.fault]))
    return Struck(t)


def _suspend(target: Target) -> Struck:
    t = time.monotonic()
    send_all(target.all_pids, signal.SIGSTOP)
    time.sleep(SUSPENDED_S)
    resumed = time.monotonic()
    send_all(target.all_pids, signal.SIGCONT)
    return Struck(t, resumed)


def _wake_hooks(cell: Cell, target: Target) -> None:
    """Wake the hooks of the processes that make the fault."""
    for process in hooks.acting(cell):
        os.kill(target.pids[process], hooks.STRIKE)


def _limit(pid: int, kind: int, most: int) -> None:
    _, hard = resource.prlimit(pid, kind)
    resource.prlimit(pid, kind, (most, hard))


def _memory_bytes(pid: int) -> int:
    """Size of the address space of a process [byte]."""
    pages = int(Path(f"/proc/{pid}/statm").read_text().split()[0])
    return pages * os.sysconf("SC_PAGE_SIZE")
