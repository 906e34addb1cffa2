"""Memory and file descriptors of the processes of a live run: growth and leaks show here."""

import contextlib
import os
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

EVERY_S = 5.0
"""Time between two samples [s]."""

SETTLED_S = 60.0
"""Age at which a process has allocated its working memory [s]. Growth is computed from this age on."""

LEAST_S = 120.0
"""Shortest settled run for which growth per hour is reported [s]."""

MB = 1 << 20


@dataclass(frozen=True)
class ProcessFootprint:
    """Memory and file descriptors of a process: first, last and largest value."""

    memory_MB: list[float]
    growth_MB_per_h: float | None
    """Growth of memory [MB/h]; None if the run was too short."""
    descriptors: list[int]


class Footprint:
    """Sampler of the memory and file descriptors of processes."""

    def __init__(self, pids: Mapping[str, Callable[[], int]], processes: Path = Path("/proc")):
        """Start without samples; `pids` returns the present identifier of each process, which may change."""
        self._pids, self._processes = pids, processes
        self._page = os.sysconf("SC_PAGE_SIZE")
        self._rows: dict[str, list[tuple[float, int, int, int]]] = {name: [] for name in pids}
        self._begun, self._seen = time.monotonic(), -np.inf

    def check(self) -> None:
        """Sample every process, if `EVERY_S` have passed. Call this several times a second."""
        now = time.monotonic()
        if now - self._seen < EVERY_S:
            return
        self._seen = now
        for name, pid in self._pids.items():
            folder = self._processes / str(pid())
            with contextlib.suppress(OSError, IndexError, ValueError):  # The process has just died.
                pages = int((folder / "statm").read_text().split()[1])
                row = (now - self._begun, pid(), pages * self._page, len(os.listdir(folder / "fd")))
                self._rows[name].append(row)

    def figures(self) -> dict[str, ProcessFootprint]:
        """Return the footprint by process; for a replaced process that of the last replacement."""
        return {name: _figures(rows) for name, rows in self._rows.items() if rows}


def _figures(rows: list[tuple[float, int, int, int]]) -> ProcessFootprint:
    of_last = np.array([(t, memory / MB, files) for t, pid, memory, files in rows if pid == rows[-1][1]])
    t, memory, files = of_last.T
    settled = t >= t[0] + SETTLED_S
    growth = None
    if settled.any() and t[-1] - t[settled][0] >= LEAST_S:
        growth = round(3600.0 * float(np.polyfit(t[settled], memory[settled], 1)[0]), 3)
    return ProcessFootprint(
        [round(float(value), 1) for value in (memory[0], memory[-1], memory.max())],
        growth,
        [int(value) for value in (files[0], files[-1], files.max())],
    )
