"""Runners of tasks: one interface for this process, processes of this computer, and a cluster."""

from collections.abc import Callable, Generator, Sequence
from dataclasses import dataclass
from typing import Protocol, runtime_checkable

from .task import Result, TaskBatch
from .work import place, work_off

LOSSES_MAX = 3
"""Number of lost workers after which a task is given up, because the task itself may end the workers."""


@dataclass(frozen=True)
class FinishedBatch:
    """Results of a batch, or of a part of it."""

    results: Sequence[Result]


@dataclass(frozen=True)
class LostBatch:
    """Tasks that must run again because their worker ended without a result."""

    batch: TaskBatch


@dataclass(frozen=True)
class RescheduledTasks:
    """Tasks that a cluster runs again by itself after a lost worker."""

    tasks: int


Event = FinishedBatch | LostBatch | RescheduledTasks
Take = Callable[[], TaskBatch | None]
"""Source of batches; None while there is no batch. A lost batch comes back through it."""


@runtime_checkable
class Runner(Protocol):
    """Interface of a runner, which runs batches until there are no more."""

    workers: int
    name: str

    def run(self, take: Take) -> Generator[Event, None, None]:
        """Yield all events. Closing the generator ends the running tasks."""
        ...


class InThisProcess:
    """Runner in this process, one task after the other."""

    name, workers = "this process", 1

    def run(self, take: Take) -> Generator[Event, None, None]:
        """Yield results, one task at a time."""
        while (batch := take()) is not None:
            for result in work_off(batch.tasks, place()):
                yield FinishedBatch([result])
