"""Start of processes with a connection to their parent.

Only the parent reacts to Ctrl-C, Ctrl-Z, SIGQUIT, a closed terminal (SIGHUP) and SIGTERM, even during the start of a
process. These signals reach all processes of a terminal or of a service at once, and the guard must lower the arm
meanwhile. Each process therefore has a session of its own, without the terminal.
"""

import contextlib
import multiprocessing
import os
import signal
import sys
import threading
from collections.abc import Callable, Iterator
from functools import partial
from multiprocessing import resource_tracker
from multiprocessing.connection import Connection
from multiprocessing.process import BaseProcess
from typing import Any

from exograv.errors import ExogravError

END_SIGNALS = tuple(
    getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP", "SIGQUIT") if hasattr(signal, name)
)
"""Signals by which a person or a service ends a command."""


def spawned(
    name: str,
    target: Callable[[Any, Connection], object],
    job: object,
    *,
    is_daemon: bool = True,
    heeds_terminate: bool = False,
) -> tuple[BaseProcess, Connection]:
    """Start a fresh interpreter that runs `target(job, line)`; return the process and the parent's end of the line.

    Do not take real-time rights before: the process inherits them. A daemon ends when its parent exits, and cannot
    start processes. With `heeds_terminate` SIGTERM ends the process; otherwise only its line or SIGKILL does.
    """
    context = multiprocessing.get_context("spawn")
    ours, theirs = context.Pipe()
    begin = partial(_begin, heeds_terminate=heeds_terminate)
    process = context.Process(target=begin, args=(target, job, theirs), name=name, daemon=is_daemon)
    start_quietly(process, target)
    theirs.close()
    return process, ours


def _begin(
    target: Callable[[Any, Connection], object], job: object, parent: Connection, *, heeds_terminate: bool
) -> None:
    for number in END_SIGNALS:
        signal.signal(number, signal.SIG_IGN)  # another thread than the main one may have started it
    if hasattr(os, "setsid"):
        os.setsid()
    if heeds_terminate:
        signal.signal(signal.SIGTERM, signal.SIG_DFL)
    try:
        target(job, parent)
    except ExogravError as error:  # A sentence for the user: the traceback of an unforeseen error is printed.
        sys.exit(f"The process '{multiprocessing.current_process().name}' has ended: {error}")


def start_quietly(process: BaseProcess, target: Callable[..., object]) -> None:
    """Start a process that ignores the end signals and does not run the caller's script again.

    A fresh interpreter otherwise imports the script that called us. A script without `if __name__ == "__main__":`
    would then begin its flight again in each process.
    """
    hidden = contextlib.nullcontext() if target.__module__ == "__main__" else _script_hidden()
    with end_signals_ignored(), hidden:
        process.start()


@contextlib.contextmanager
def _script_hidden() -> Iterator[None]:
    """Hide the file of the main module: `multiprocessing` then imports nothing, as in an interactive session."""
    script = vars(sys.modules["__main__"])
    there = {name: script.pop(name) for name in ("__file__", "__spec__") if name in script}
    script["__spec__"] = None  # `multiprocessing` reads it without a default
    try:
        yield
    finally:
        script.update(there)


@contextlib.contextmanager
def end_signals_ignored() -> Iterator[None]:
    """Ignore these signals in processes that start within the block; their parent ends them, without a traceback."""
    if threading.current_thread() is not threading.main_thread():
        yield  # only the main thread may set a signal handler
        return
    before = {number: signal.signal(number, signal.SIG_IGN) for number in END_SIGNALS}
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


def start_resource_tracker() -> None:
    """Start Python's process that deletes shared memory of processes that were killed; no terminal ends it.

    Python itself protects it from Ctrl-C and SIGTERM only. The other signals are blocked here in the calling thread,
    and the new process inherits that.
    """
    if not hasattr(signal, "pthread_sigmask"):
        return  # Windows has no such process
    before = signal.pthread_sigmask(signal.SIG_BLOCK, (signal.SIGHUP, signal.SIGQUIT, signal.SIGTSTP))
    try:
        resource_tracker.ensure_running()
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)
