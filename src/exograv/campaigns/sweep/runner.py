"""Who does the tasks: one interface for this process, processes of this computer, and a cluster."""

from collections.abc import Callable, Generator, Sequence
from dataclasses import dataclass
from typing import Protocol, runtime_checkable

from .task import Result, TaskBatch
from .work import place, work_off

LOSSES_MAX = 3
"""After so many losses of its worker a task is given up: it may be what takes the workers down."""


@dataclass(frozen=True)
class FinishedBatch:
    """Results of a batch, or of a part of it."""

    results: Sequence[Result]


@dataclass(frozen=True)
class LostBatch:
    """A worker was lost with these tasks; they are to run again."""

    batch: TaskBatch


@dataclass(frozen=True)
class RescheduledTasks:
    """A cluster lost a worker with so many tasks, and runs them again by itself."""

    tasks: int


Event = FinishedBatch | LostBatch | RescheduledTasks
Take = Callable[[], TaskBatch | None]
"""The next batch; none while there is none. A lost one comes back through it."""


@runtime_checkable
class Runner(Protocol):
    """Runs batches until there are no more."""

    workers: int
    name: str

    def run(self, take: Take) -> Generator[Event, None, None]:
        """Everything that happens; closing it ends what runs."""
        ...


class InThisProcess:
    """One after the other."""

    name, workers = "this process", 1

    def run(self, take: Take) -> Generator[Event, None, None]:
        """A task at a time."""
        while (batch := take()) is not None:
            for result in work_off(batch.tasks, place()):
                yield FinishedBatch([result])
