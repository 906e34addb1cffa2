"""Task kind `probe`: tasks that only take time, to try a cluster before a long sweep."""

import os
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Annotated, Literal

import numpy as np
from pydantic import Field

from .task import Grid, SweepTask, TaskKind, each

Does = Literal["work", "fail", "die"]
"""Behaviour of a probe: `work` uses processor time, `fail` raises an error, `die` ends the worker's process at once.

`die` imitates a worker that is killed because the computer has no memory left.
"""


@dataclass(frozen=True)
class ProbeTask:
    """Settings of one probe."""

    number: Annotated[int, "number of the task"]
    seconds: Annotated[float, "processor time", "s"]
    does: Annotated[Does, "`work`, `fail` or `die`"]


@dataclass(frozen=True)
class ProbeResult:
    """Result of one probe task."""

    drawn: Annotated[float | None, "one normal number from the task's own seed"]


class ProbeGrid(Grid):
    """Grid of `count` probes with the same processor time."""

    count: Annotated[int, Field(ge=1, le=10_000_000)]
    seconds: Annotated[float, Field(ge=0.0, le=3600.0)] = 0.1
    """Processor time of each task [s]."""

    batch: Annotated[int, Field(ge=1, le=1000)] = 1
    """Number of tasks in a batch for one worker."""

    fail: list[int] = Field(default=[])
    """Numbers of tasks that raise an error."""

    die: list[int] = Field(default=[])
    """Numbers of tasks that end their worker's process."""

    def __len__(self) -> int:
        return self.count

    def groups(self) -> Iterator[Sequence[ProbeTask]]:
        """Yield tasks with consecutive numbers as batches."""
        for first in range(0, self.count, self.batch):
            numbers = range(first, min(first + self.batch, self.count))
            yield [ProbeTask(number, self.seconds, self._does(number)) for number in numbers]

    def _does(self, number: int) -> Does:
        if number in self.die:
            return "die"
        return "fail" if number in self.fail else "work"


def _run(task: SweepTask) -> ProbeResult:
    settings: ProbeTask = task.settings
    end = time.process_time() + settings.seconds
    if settings.does == "die":
        os._exit(1)
    if settings.does == "fail":
        raise ValueError(f"task {settings.number} was told to fail")
    while time.process_time() < end:
        pass
    return ProbeResult(float(np.random.default_rng(task.seed).normal()))


PROBE = TaskKind(
    "probe",
    "Takes time and computes nothing: tries a cluster.",
    ProbeGrid,
    ProbeTask,
    ProbeResult,
    ("number",),
    each(_run),
)
