"""Task of a sweep: immutable settings, from which alone its key and its seed follow."""

import hashlib
import json
from collections.abc import Callable, Iterator, Sequence
from dataclasses import asdict, dataclass, replace
from functools import cached_property
from typing import Annotated, Any, Literal

from exograv.model.rig_settings import Settings

Outcome = Literal["done", "failed", "lost"]
"""Outcome: done; failed, and would fail again; or lost, because several workers were lost with the task."""

KEY_BITS = 128
SEED_BITS = 63  # This fits a signed 64-bit column.


@dataclass(frozen=True)
class SweepTask:
    """Task that runs once."""

    kind: str
    settings: Any
    """Settings as a frozen dataclass of plain values."""

    @cached_property
    def key(self) -> str:
        """Key of the settings, the same in every sweep and in every order."""
        text = json.dumps([self.kind, asdict(self.settings)], sort_keys=True, ensure_ascii=True)
        return hashlib.sha256(text.encode()).hexdigest()[: KEY_BITS // 4]

    @property
    def seed(self) -> int:
        """Seed for random values that the settings do not determine."""
        return int(self.key, 16) >> (KEY_BITS - SEED_BITS)


@dataclass(frozen=True)
class TaskBatch:
    """Tasks that one worker runs in sequence, because they share work."""

    tasks: tuple[SweepTask, ...]
    losses: int = 0
    """Number of workers lost with this batch."""

    @cached_property
    def key(self) -> str:
        """Key of these tasks in this order."""
        return hashlib.sha256("".join(task.key for task in self.tasks).encode()).hexdigest()[: KEY_BITS // 4]

    def lost(self) -> "TaskBatch":
        """Return the batch after one more lost worker."""
        return replace(self, losses=self.losses + 1)


@dataclass(frozen=True)
class Result:
    """Result of one task."""

    task: SweepTask
    outcome: Annotated[Outcome, "`done`, `failed` or `lost`"]
    values: Any = None
    """Dataclass of the kind's `results`; None if there is no result."""

    error: Annotated[str | None, "reason for a missing result"] = None
    wall_s: Annotated[float, "time since the batch's previous result: shared work counts for the first"] = 0.0
    worker: Annotated[str, "computer"] = ""
    retries: Annotated[int, "number of workers lost with it before"] = 0


class Grid(Settings):
    """Contents of `[grid]` in a study file; each kind of task has its own."""

    def __len__(self) -> int:
        """Return the number of tasks."""
        raise NotImplementedError  # each kind of task has its own; pydantic's class cannot be abstract

    def groups(self) -> Iterator[Sequence[Any]]:
        """Yield the settings of all tasks lazily, in groups that share work."""
        raise NotImplementedError  # each kind of task has its own; pydantic's class cannot be abstract


Run = Callable[[Sequence[SweepTask]], Iterator[tuple[SweepTask, Any]]]
"""Function that runs the tasks of one group. It yields each task with its results, or with the reason for none.

After an exception with several tasks, each runs alone. An exception with one task is the task's failure.
"""


@dataclass(frozen=True)
class TaskKind:
    """Kind of task: its grid, its columns, and the function that runs it."""

    name: str
    what: str
    """Description in one sentence."""

    grid: type[Grid]
    settings: type
    """Dataclass of a task's settings. Its fields and those of `results` are columns of the table."""

    results: type
    """Dataclass of the results of a successful task."""

    person: tuple[str, ...]
    """Settings that distinguish one wearer from another; the planning table counts these."""

    run: Run


def each(run_one: Callable[[SweepTask], object]) -> Run:
    """Return the run function of a kind whose tasks share no work."""

    def run(tasks: Sequence[SweepTask], /) -> Iterator[tuple[SweepTask, Any]]:
        for task in tasks:
            yield task, run_one(task)

    return run
