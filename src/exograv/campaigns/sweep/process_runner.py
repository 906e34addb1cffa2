"""Processes of this computer, each with a line of its own: one that dies takes down nothing but its task."""

import contextlib
from collections.abc import Generator
from dataclasses import dataclass, field, replace
from multiprocessing.connection import Connection, wait
from multiprocessing.process import BaseProcess

from exograv.runtime.processes.spawn import spawned

from .runner import Event, Finished, Lost, Take
from .task import Result, TaskBatch
from .work import place, work_off


@dataclass
class _Worker:
    process: BaseProcess
    line: Connection
    batch: TaskBatch | None = None
    done: set[str] = field(default_factory=set)

    def left(self) -> TaskBatch:
        """Of its batch."""
        batch = self.batch or TaskBatch(())
        return replace(batch, tasks=tuple(task for task in batch.tasks if task.key not in self.done))


class OnProcesses:
    """So many processes; one that is lost is replaced."""

    name = "processes"

    def __init__(self, workers: int):
        self.workers = workers
        self.crew: list[_Worker] = []
        """For tests, which end one."""

    def run(self, take: Take) -> Generator[Event, None, None]:
        """Results as they are done."""
        try:
            while True:
                self._give(take)
                busy = [worker for worker in self.crew if worker.batch is not None]
                if not busy:
                    return
                ready = wait([worker.line for worker in busy])
                for worker in busy:
                    if worker.line in ready:
                        yield from self._heard(worker)
        finally:
            self._end()

    def _give(self, take: Take) -> None:
        idle = [worker for worker in self.crew if worker.batch is None]
        while len(self.crew) - len(idle) < self.workers:
            batch = take()
            if batch is None:
                return
            worker = idle.pop() if idle else self._hired()
            worker.batch, worker.done = batch, set()
            with contextlib.suppress(OSError):  # it has died; its line says so when it is listened to
                worker.line.send(batch)

    def _heard(self, worker: _Worker) -> Generator[Event, None, None]:
        try:
            said: Result | None = worker.line.recv()
        except (EOFError, OSError):
            self.crew.remove(worker)
            worker.process.join()
            worker.line.close()
            if (left := worker.left()).tasks:
                yield Lost(left)
            return
        if said is None:
            worker.batch = None
        else:
            worker.done.add(said.task.key)
            yield Finished([said])

    def _hired(self) -> _Worker:
        worker = _Worker(*spawned("sweep worker", _work, None))
        self.crew.append(worker)
        return worker

    def _end(self) -> None:
        for worker in self.crew:
            worker.process.terminate()
        for worker in self.crew:
            worker.process.join()
            worker.line.close()
        self.crew.clear()


def _work(_job: object, line: Connection) -> None:
    while True:
        try:
            batch: TaskBatch = line.recv()
        except EOFError:
            return
        for result in work_off(batch.tasks, place()):
            line.send(result)
        line.send(None)
