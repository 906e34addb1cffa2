"""Machines worked off one after the other, or by several processes; runs arrive as they are done."""

import signal
from collections.abc import Generator, Iterator, Sequence
from concurrent.futures import Future, ProcessPoolExecutor
from multiprocessing import get_context
from multiprocessing.queues import Queue
from queue import Empty

from .runs import MethodRun
from .work import Tell, WearerTask, run_machine

WAIT_S = 0.3

_queue: "Queue[MethodRun | str] | None" = None
"""Of a worker process: where it puts finished runs, and sentences about what it does."""


def run_all(
    machines: Sequence[Sequence[WearerTask]], seconds: float, processes: int, tell: Tell
) -> Generator[MethodRun, None, None]:
    """Every run as soon as it is done; closing the iterator ends the processes."""
    if processes == 1:
        for tasks in machines:
            yield from run_machine(tasks, seconds, tell)
        return
    # A fresh interpreter each: a copy of this one would inherit the progress line's thread in mid-step.
    context = get_context("spawn")
    queue: Queue[MethodRun | str] = context.Queue()
    pool = ProcessPoolExecutor(processes, mp_context=context, initializer=_begin, initargs=(queue,))
    try:
        futures = [pool.submit(_work, list(tasks), seconds) for tasks in machines]
        yield from _arriving(queue, futures, tell)
    finally:
        for process in list(pool._processes.values()):
            process.terminate()
        pool.shutdown(wait=True, cancel_futures=True)


def _arriving(queue: "Queue[MethodRun | str]", futures: Sequence[Future[None]], tell: Tell) -> Iterator[MethodRun]:
    while True:
        ended = all(future.done() for future in futures)
        try:
            one = queue.get(timeout=WAIT_S)
        except Empty:
            if ended:
                break
            continue
        if isinstance(one, MethodRun):
            yield one
        else:
            tell(one)
    for future in futures:
        future.result()  # an exception that is nobody's mistake at the keyboard is not swallowed


def _begin(queue: "Queue[MethodRun | str]") -> None:
    # Ctrl-C reaches every process of the terminal; this one is ended by the one that started it.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    global _queue  # noqa: PLW0603 - the one thing that a worker process is given
    _queue = queue


def _work(tasks: Sequence[WearerTask], seconds: float) -> None:
    queue = _queue
    if queue is None:
        raise RuntimeError("A worker of the benchmark was started without its queue.")
    for run in run_machine(tasks, seconds, queue.put):
        queue.put(run)
