"""Processes and shared memory of a session, seen from outside by the kernel's own tables."""

import contextlib
import os
import re
import signal
import time
from collections.abc import Iterable, Iterator
from pathlib import Path

import numpy as np

from .cell import ORDERS

MEMORY = Path("/dev/shm")
TRACKER_S = 2.0
"""Time for a tracker to delete the memory of a session that has ended [s]."""

_MAPPED = re.compile(r"/dev/shm/(\S+)")


def processes_of(orders: Path) -> Iterator[int]:
    """Yield the identifiers of all living processes of a session, which carry its instructions in their environment."""
    mark = f"{ORDERS}={orders}".encode()
    for folder in Path("/proc").iterdir():
        if folder.name.isdecimal() and int(folder.name) != os.getpid():
            with contextlib.suppress(OSError):
                if mark in (folder / "environ").read_bytes().split(b"\0") and not _is_zombie(folder):
                    yield int(folder.name)


def _is_zombie(folder: Path) -> bool:
    return (folder / "stat").read_text().rpartition(")")[2].split()[0] == "Z"


def is_running(pid: int) -> bool:
    """Return True if this process lives and is no zombie."""
    try:
        return not _is_zombie(Path(f"/proc/{pid}"))
    except OSError:
        return False


def is_tracker(pid: int) -> bool:
    """Return True for a process of Python that deletes shared memory when its session has ended."""
    try:
        return b"resource_tracker" in Path(f"/proc/{pid}/cmdline").read_bytes()
    except OSError:
        return False


def memory_of(pids: list[int]) -> set[str]:
    """Return the names of shared memory that these processes have mapped."""
    names = set[str]()
    for pid in pids:
        with contextlib.suppress(OSError):
            names |= set(_MAPPED.findall(Path(f"/proc/{pid}/maps").read_text()))
    return names


def left_memory(names: set[str]) -> list[str]:
    """Return the names of shared memory that still exist."""
    return sorted(name for name in names if (MEMORY / name).exists())


def acknowledged_ticks(ring: str, so_far: int) -> int:
    """Read the number of ticks that the recorder has acknowledged; `so_far` if the ring is gone."""
    try:
        head = np.fromfile(MEMORY / ring, "<u8", 3)
    except OSError:
        return so_far
    return max(so_far, int(head[1])) if len(head) == 3 else so_far


def send_all(pids: list[int], number: signal.Signals) -> None:
    """Send a signal to each process that still lives."""
    for pid in pids:
        with contextlib.suppress(ProcessLookupError):
            os.kill(pid, number)


def end_all(orders: Path, patience_s: float) -> list[int]:
    """Wait for the end of all processes of a session, then kill the rest and return their identifiers."""
    left = _left_after(orders, patience_s)
    killed = [pid for pid in left if not is_tracker(pid)]
    send_all(killed, signal.SIGKILL)
    # A tracker ends with its session. It deletes the memory that the killed processes have left.
    send_all(_left_after(orders, TRACKER_S), signal.SIGKILL)
    return killed


def _left_after(orders: Path, patience_s: float) -> list[int]:
    until = time.monotonic() + patience_s
    while (left := list(processes_of(orders))) and time.monotonic() < until:
        time.sleep(0.05)
    return left


def forget_memory(names: Iterable[str]) -> None:
    """Delete shared memory that a session has left."""
    for name in names:
        (MEMORY / name).unlink(missing_ok=True)
