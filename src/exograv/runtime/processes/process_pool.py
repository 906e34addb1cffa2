"""Pool of processes that do tasks; results come as they are ready, and a task that kills its process is reported.

Each process has its own connection to the parent. If a process dies, only its task is lost, and another process takes
its place. Only the parent receives Ctrl-C, and ends the processes.
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
"""Callback that receives a message about the work in progress."""

Work = Callable[[Task, Tell], Iterable[Result]]
"""Function that does a task in another process and yields its results. It must belong to a module, so that it can be
pickled."""

END_S = 5.0
"""Time for a process to end when asked; then it is killed [s]."""


@dataclass(frozen=True)
class Arrived(Generic[Task, Result]):
    """Result of a task."""

    task: Task
    result: Result


@dataclass(frozen=True)
class LostTask(Generic[Task]):
    """Task whose process died before the end; its earlier results have arrived."""

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
        """Prepare a pool; processes start when there is work for them.

        Args:
            processes: Number of processes at the same time.
            tell: Function that gets the messages of all tasks, in the parent.
        """
        self._processes, self._tell, self._workers = processes, tell, list[_Worker]()

    @property
    def busy(self) -> list[BaseProcess]:
        """Processes that have a task."""
        return [worker.process for worker in self._workers if worker.is_busy]

    def run(
        self, work: Work[Task, Result], take: Callable[[], Task | None]
    ) -> Iterator[Arrived[Task, Result] | LostTask[Task]]:
        """Do tasks until there are no more, and yield results and lost tasks.

        Args:
            work: Function that does one task.
            take: Function that returns the next task; None while there is none. It may return a lost task again.

        Raises:
            Exception: Raised by a task; results that had arrived from other tasks are yielded before.
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
        """Yield the number of the task and a result, as they come.

        Raises:
            RigError: A process died; `lost` is the message.
        """
        left = iter(enumerate(tasks))
        for event in self.run(_Numbered(work), lambda: next(left, None)):
            if isinstance(event, LostTask):
                raise RigError(lost)
            yield event.task[0], event.result

    def close(self) -> None:
        """End all processes at once."""
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
            with contextlib.suppress(OSError):  # the process has died; reading its connection reports it
                worker.line.send((work, task))

    def _started(self) -> _Worker:
        # A task may start processes of its own, and a daemon process must not.
        worker = _Worker(*spawned("pool worker", _serve, None, is_daemon=False, heeds_terminate=True))
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
    """Yield the number of the task and a result, as they come; with one process, task by task in this process.

    Closing the generator ends the processes.

    Raises:
        RigError: A process died; `lost` is the message.
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
    """Yield results in the order of their tasks; each task gives one result."""
    early, number = dict[int, Result](), 0
    for arrived, result in numbered:
        early[arrived] = result
        while number in early:
            yield early.pop(number)
            number += 1


@dataclass(frozen=True)
class _Numbered(Generic[Task, Result]):
    """Function that does a task that carries a number."""

    work: Work[Task, Result]

    def __call__(self, numbered: tuple[int, Task], tell: Tell) -> Iterable[Result]:
        return self.work(numbered[1], tell)


def _serve(_job: object, line: Connection) -> None:
    """Run tasks in a process of the pool, until the parent process ends."""
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
    # A killed parent ends no process, and a process within a task does not read its connection.
    parent = parent_process()
    if parent is not None:
        parent.join()
        os._exit(1)


def _portable(error: Exception) -> Exception:
    """Return the error with its traceback as a note, or a RuntimeError with its text if it cannot be sent."""
    told = "".join(traceback.format_exception(error))
    error.add_note(f"In a process of the pool:\n{told}")
    try:
        pickle.loads(pickle.dumps(error))
    except Exception:  # noqa: BLE001 - pickling an exception may raise any error
        return RuntimeError(told)
    return error
