"""Careers worked off by several processes; what came of each arrives when it is done."""

import contextlib
import os
import signal
import threading
from collections.abc import Generator, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from multiprocessing import get_context, parent_process
from multiprocessing.queues import Queue
from pathlib import Path
from queue import Empty

from exograv.errors import RigError
from exograv.loop.pilot import Progress

from .options import Career, StudyOptions
from .participants import Lived, live

WAIT_S = 0.3
TOLD_EVERY = 0.01
"""Share of a session between two sentences of a worker."""

Done = tuple[int, Lived]
"""Which of the careers, and what came of it."""

_queue: "Queue[tuple[str, float]] | None" = None
"""Of a worker process: what it is doing."""


def live_all(
    careers: Sequence[tuple[Career, StudyOptions]], folder: Path, processes: int, tell: Progress
) -> Generator[Done, None, None]:
    """Everybody's, as they are done; closing the generator ends the processes.

    Args:
        careers: To be gone through, each with the options that hold for it.
        folder: For recordings.
        processes: At the same time.
        tell: Told the name of a career, and the share of it that is done.

    Raises:
        ExogravError: A machine or run was refused, or the disk is full.
    """
    if processes == 1:
        for k, (career, options) in enumerate(careers):
            yield k, live(career, options, folder, tell)
        return
    context = get_context("spawn")
    queue: Queue[tuple[str, float]] = context.Queue()
    pool = ProcessPoolExecutor(processes, mp_context=context, initializer=_begin, initargs=(queue,))
    try:
        waiting = {pool.submit(_work, *one, folder): k for k, one in enumerate(careers)}
        yield from _arriving(waiting, queue, tell)
    except BrokenProcessPool:
        raise RigError(
            "A process of the study was ended from outside, perhaps because memory ran out. Careers that were done are "
            "kept: go on with --resume, and with fewer --processes."
        ) from None
    finally:
        for process in list(pool._processes.values()):
            process.terminate()
        pool.shutdown(wait=True, cancel_futures=True)


def _arriving(
    waiting: dict[Future[Lived], int], queue: "Queue[tuple[str, float]]", tell: Progress
) -> Generator[Done, None, None]:
    while waiting:
        done, _ = wait(waiting, WAIT_S, FIRST_COMPLETED)
        with contextlib.suppress(Empty):
            while True:
                tell(*queue.get_nowait())
        for future in sorted(done, key=lambda one: one.exception() is not None):  # what came of others is kept first
            yield waiting.pop(future), future.result()


def _begin(queue: "Queue[tuple[str, float]]") -> None:
    # Ctrl-C reaches every process of the terminal; this one is ended by the one that started it.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=_end_with_parent, daemon=True).start()
    global _queue  # noqa: PLW0603 - the one thing that a worker process is given
    _queue = queue


def _end_with_parent() -> None:
    """Whoever started this was killed: nobody waits for what comes out, and nobody would end a process that waits."""
    parent = parent_process()
    if parent is not None:
        parent.join()
        os._exit(1)


def _work(career: Career, options: StudyOptions, folder: Path) -> Lived:
    queue, said = _queue, ("", -1.0)
    if queue is None:
        raise RuntimeError("A worker of the study was started without its queue.")

    def tell(text: str, share: float) -> None:
        nonlocal said
        if text != said[0] or share >= said[1] + TOLD_EVERY:
            said = (text, share)
            queue.put(said)

    return live(career, options, folder, tell)
