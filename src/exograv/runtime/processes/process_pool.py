"""Processes of this computer that do tasks. Results arrive as they come; a task that kills its process is told.

Each process has a line of its own to the parent. A process that dies takes nothing with it but its task, and another
process takes its place. Ctrl-C is for the parent alone, which ends the processes.
"""

import contextlib
import os
import pickle
import threading
import traceback
from collections.abc import Callable, Generator, Iterable, Iterator, Sequence
from dataclasses import dataclass
from multiprocessing import parent_process
from multiprocessing.connection import Connection, wait
from multiprocessing.process import BaseProcess
from typing import Any, Generic, TypeVar

from exograv.errors import RigError

from .spawn import spawned

Task = TypeVar("Task")
Result = TypeVar("Result")

Tell = Callable[[Any], object]
"""Takes a message about what is being done."""

Work = Callable[[Task, Tell], Iterable[Result]]
"""Does a task in another process and gives its results one by one. A function of a module, or a partial of one."""

END_S = 5.0
"""For a process that was asked to end; then it is killed [s]."""


@dataclass(frozen=True)
class Arrived(Generic[Task, Result]):
    """One result."""

    task: Task
    result: Result


@dataclass(frozen=True)
class LostTask(Generic[Task]):
    """A process died before it had done this task; results that it gave before have arrived."""

    task: Task


@dataclass
class _Worker:
    process: BaseProcess
    line: Connection
    task: Any = None
    is_busy: bool = False


class ProcessPool:
    """Processes that live until the pool is closed. `with ProcessPool(...) as pool:`."""

    def __init__(self, processes: int, tell: Tell = lambda _: None):
        """Start nothing yet: processes start when there is work for them.

        Args:
            processes: Number of processes at the same time.
            tell: Gets the messages of all tasks, in the parent.
        """
        self._processes, self._tell, self._workers = processes, tell, list[_Worker]()

    @property
    def busy(self) -> list[BaseProcess]:
        """Processes that have a task."""
        return [worker.process for worker in self._workers if worker.is_busy]

    def run(
        self, work: Work[Task, Result], take: Callable[[], Task | None]
    ) -> Iterator[Arrived[Task, Result] | LostTask[Task]]:
        """Do tasks until there are no more.

        Args:
            work: Does one task.
            take: Gives the next task; None while there is none. A task that was lost may come back through it.

        Raises:
            Exception: Raised by a task; results that had arrived from other tasks are given before.
        """
        while True:
            self._give(work, take)
            busy = [worker for worker in self._workers if worker.is_busy]
            if not busy:
                return
            ready = wait([worker.line for worker in busy])
            events = [event for worker in busy if worker.line in ready for event in self._heard(worker)]
            yield from (event for event in events if isinstance(event, Arrived))
            yield from (event for event in events if isinstance(event, LostTask))
            for event in events:
                if isinstance(event, Exception):
                    raise event

    def results(self, work: Work[Task, Result], tasks: Sequence[Task], lost: str) -> Iterator[tuple[int, Result]]:
        """Number of the task and result, as they come.

        Raises:
            RigError: A process died; `lost` is the sentence that says so.
        """
        left = iter(enumerate(tasks))
        for event in self.run(_Numbered(work), lambda: next(left, None)):
            if isinstance(event, LostTask):
                raise RigError(lost)
            yield event.task[0], event.result

    def close(self) -> None:
        """End all processes, whatever they do."""
        for worker in self._workers:
            worker.process.terminate()
        for worker in self._workers:
            worker.process.join(END_S)
            worker.process.kill()
            worker.process.join()
            worker.line.close()
        self._workers.clear()

    def __enter__(self) -> "ProcessPool":
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _give(self, work: Work[Task, Result], take: Callable[[], Task | None]) -> None:
        idle = [worker for worker in self._workers if not worker.is_busy]
        while len(self._workers) - len(idle) < self._processes:
            task = take()
            if task is None:
                return
            worker = idle.pop() if idle else self._started()
            worker.task, worker.is_busy = task, True
            with contextlib.suppress(OSError):  # the process has died; its line says so when it is heard
                worker.line.send((work, task))

    def _started(self) -> _Worker:
        # A task may start processes of its own, which a daemon must not.
        worker = _Worker(*spawned("pool worker", _serve, None, is_daemon=False))
        self._workers.append(worker)
        return worker

    def _heard(self, worker: _Worker) -> Iterator[Arrived[Any, Any] | LostTask[Any] | Exception]:
        try:
            while worker.is_busy and worker.line.poll():
                match worker.line.recv():
                    case ("told", message):
                        self._tell(message)
                    case ("result", result):
                        yield Arrived(worker.task, result)
                    case ("failed", error):
                        worker.is_busy = False
                        yield error
                    case _:
                        worker.is_busy = False
        except (EOFError, OSError):
            self._workers.remove(worker)
            worker.process.join()
            worker.line.close()
            yield LostTask(worker.task)


def results_of(
    work: Work[Task, Result], tasks: Sequence[Task], processes: int, tell: Tell, lost: str
) -> Generator[tuple[int, Result], None, None]:
    """Number of the task and result: task by task in this process if it is one process, else as they come.

    Closing the generator ends the processes.

    Raises:
        RigError: A process died; `lost` is the sentence that says so.
    """
    processes = min(processes, len(tasks))
    if processes > 1:
        with ProcessPool(processes, tell) as pool:
            yield from pool.results(work, tasks, lost)
        return
    for number, task in enumerate(tasks):
        for result in work(task, tell):
            yield number, result


def in_order(numbered: Iterable[tuple[int, Result]]) -> Iterator[Result]:
    """Results by the number of their tasks, of tasks that give one result each."""
    early, number = dict[int, Result](), 0
    for arrived, result in numbered:
        early[arrived] = result
        while number in early:
            yield early.pop(number)
            number += 1


@dataclass(frozen=True)
class _Numbered(Generic[Task, Result]):
    """Work on tasks that carry a number."""

    work: Work[Task, Result]

    def __call__(self, numbered: tuple[int, Task], tell: Tell) -> Iterable[Result]:
        return self.work(numbered[1], tell)


def _serve(_job: object, line: Connection) -> None:
    """Be a process of the pool, until the parent is gone."""
    threading.Thread(target=_end_with_parent, daemon=True).start()
    with contextlib.suppress(EOFError, BrokenPipeError):
        while True:
            work, task = line.recv()
            try:
                for result in work(task, lambda message: line.send(("told", message))):
                    line.send(("result", result))
            except Exception as error:  # noqa: BLE001 - the parent raises it again
                line.send(("failed", _portable(error)))
            else:
                line.send(("done", None))


def _end_with_parent() -> None:
    # A parent that was killed ends no process, and a process in the middle of a task does not hear its line.
    parent = parent_process()
    if parent is not None:
        parent.join()
        os._exit(1)


def _portable(error: Exception) -> Exception:
    """The same with its traceback as a note, or its words alone if it cannot be sent."""
    told = "".join(traceback.format_exception(error))
    error.add_note(f"In a process of the pool:\n{told}")
    try:
        pickle.loads(pickle.dumps(error))
    except Exception:  # noqa: BLE001 - an exception may break at anything when it is packed
        return RuntimeError(told)
    return error
