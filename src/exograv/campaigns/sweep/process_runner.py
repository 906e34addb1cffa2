"""Runner on processes of this computer. A process that dies loses only its batch."""

from collections.abc import Generator, Iterator
from dataclasses import replace

from exograv.runtime.processes.process_pool import Arrived, ProcessPool, Tell

from .runner import Event, FinishedBatch, LostBatch, Take
from .task import Result, TaskBatch
from .work import place, work_off


class OnProcesses:
    """Runner on several processes. A lost process is replaced."""

    name = "processes"

    def __init__(self, workers: int):
        self.workers = workers
        self.pool = ProcessPool(workers)

    def run(self, take: Take) -> Generator[Event, None, None]:
        """Yield results as they are finished."""
        done = set[str]()
        with self.pool:
            for event in self.pool.run(_work, take):
                if isinstance(event, Arrived):
                    done.add(event.result.task.key)
                    yield FinishedBatch([event.result])
                elif left := tuple(task for task in event.task.tasks if task.key not in done):
                    yield LostBatch(replace(event.task, tasks=left))


def _work(batch: TaskBatch, _tell: Tell) -> Iterator[Result]:
    yield from work_off(batch.tasks, place())
