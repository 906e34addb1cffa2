"""Processes and shared memory of a session, seen from outside by the kernel's own tables."""

import contextlib
import os
import re
import signal
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from .cell import ORDERS

MEMORY = Path("/dev/shm")
_MAPPED = re.compile(r"/dev/shm/(\S+)")


def processes_of(orders: Path) -> Iterator[int]:
    """Yield the identifiers of all living processes of a session, which carry its orders in their environment."""
    mark = f"{ORDERS}={orders}".encode()
    for folder in Path("/proc").iterdir():
        if folder.name.isdecimal() and int(folder.name) != os.getpid():
            with contextlib.suppress(OSError):
                if mark in (folder / "environ").read_bytes().split(b"\0") and not _is_zombie(folder):
                    yield int(folder.name)


def _is_zombie(folder: Path) -> bool:
    return (folder / "stat").read_text().rpartition(")")[2].split()[0] == "Z"


def words_of(pid: int) -> str:
    """Return the command line of a process; empty if it has ended."""
    try:
        return Path(f"/proc/{pid}/cmdline").read_bytes().replace(b"\0", b" ").decode(errors="replace").strip()
    except OSError:
        return ""


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


def end_all(orders: Path, patience_s: float) -> list[str]:
    """Wait for the end of all processes of a session, then kill the rest; return their command lines."""
    until = time.monotonic() + patience_s
    while (left := list(processes_of(orders))) and time.monotonic() < until:
        time.sleep(0.05)
    told = [words_of(pid) for pid in left]
    send_all(left, signal.SIGKILL)
    return told
