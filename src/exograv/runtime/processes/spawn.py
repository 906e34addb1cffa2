"""Start of processes with a connection to their parent; only the parent reacts to Ctrl-C, even during their start."""

import contextlib
import multiprocessing
import signal
import threading
from collections.abc import Callable, Iterator
from multiprocessing.connection import Connection
from multiprocessing.process import BaseProcess
from typing import Any


def spawned(
    name: str, target: Callable[[Any, Connection], object], job: object, *, is_daemon: bool = True
) -> tuple[BaseProcess, Connection]:
    """Start a fresh interpreter that runs `target(job, line)`; return the process and the parent's end of the line.

    Do not take real-time rights before: the process inherits them. A daemon ends when its parent exits, and cannot
    start processes.
    """
    context = multiprocessing.get_context("spawn")
    ours, theirs = context.Pipe()
    process = context.Process(target=_begin, args=(target, job, theirs), name=name, daemon=is_daemon)
    with keyboard_ignored():
        process.start()
    theirs.close()
    return process, ours


def _begin(target: Callable[[Any, Connection], object], job: object, parent: Connection) -> None:
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # another thread than the main one may have started it
    target(job, parent)


@contextlib.contextmanager
def keyboard_ignored() -> Iterator[None]:
    """Ignore Ctrl-C in processes that start within the block; their parent ends them, without a second traceback."""
    if threading.current_thread() is not threading.main_thread():
        yield  # only the main thread may set a signal handler
        return
    before = signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, before)
