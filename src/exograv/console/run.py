"""Run of a console, from its command to its end: the desk in this process, the pages in another one."""

import contextlib
import signal
import threading
import time
from collections.abc import Callable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass, field
from pathlib import Path
from secrets import token_bytes

from pydantic import TypeAdapter

from exograv.experiment.steered.requests import Desk
from exograv.results import MERGED
from exograv.task.totals import TotalsFigures

from .desk_link import DeskLink, Ended
from .keys import SECRET_BYTES
from .options import Address
from .page_process import PageJob
from .page_supervisor import PageSupervisor, Say, new_token
from .serve import bound
from .trial_request import TrialRequest


@dataclass(frozen=True)
class ConsoleResult:
    """Result of `exograv run console`."""

    diary: Path
    refused_lines: dict[str, int]
    """Number of refused lines by reason."""

    totals: TotalsFigures | None = field(metadata=MERGED)
    """Totals of the protocol; None without a protocol."""


Operate = Callable[[str, threading.Event], object]
"""Function that steers in place of the operator's page, from its link on. The event is set when the session ends."""


def diary_path(folder: Path) -> Path:
    """Path of the diary of a command that starts now."""
    return folder / f"console-{time.strftime('%Y%m%d-%H%M%S')}.jsonl"


def run_console(
    address: Address, folder: Path, desk: Desk, trial: TrialRequest, say: Say, operate: Operate | None = None
) -> ConsoleResult:
    """Serve the pages until Ctrl-C, or until `operate` has returned, and return what was done.

    Raises:
        Exception: As `operate`.
        ConfigError: The address cannot be used.
        ExogravError: The pages or the desk failed. The guard of the machine lowers the arm.
    """
    diary = diary_path(folder)
    with contextlib.ExitStack() as stack:
        stack.callback(desk.close)  # also if the address cannot be used
        listening, host = stack.enter_context(bound(address))

        def job(link: DeskLink) -> PageJob:
            return PageJob(link.names, address, listening, host, diary, trial, token_bytes(SECRET_BYTES), new_token())

        ended: Ended | None = None
        with ended_by_ctrl_c() as is_over, ThreadPoolExecutor(1, "operator") as threads:
            steering: list[Future[object]] = []

            def steer(link: str) -> None:
                if operate is not None and not steering:
                    steering.append(threads.submit(operate, link, is_over))
                    steering[0].add_done_callback(lambda _: is_over.set())

            pages = PageSupervisor(desk, job, address.browser and operate is None, say, operate and steer)
            try:
                pages.run(is_over)
                for one in steering:
                    one.result()
            finally:
                is_over.set()
                ended = pages.end()
    if ended is None:
        return ConsoleResult(diary, {}, None)
    totals = None if ended.totals is None else TypeAdapter(TotalsFigures).validate_python(ended.totals)
    return ConsoleResult(diary, ended.refused_lines, totals)


@contextlib.contextmanager
def ended_by_ctrl_c() -> Iterator[threading.Event]:
    """Event that Ctrl-C sets, as often as it comes.

    A shell or `uv run` passes on a Ctrl-C that the terminal has sent already. The second one must not interrupt the end
    of the session.
    """
    is_over = threading.Event()
    if threading.current_thread() is not threading.main_thread():
        yield is_over
        return
    before = signal.signal(signal.SIGINT, lambda *_: is_over.set())
    try:
        yield is_over
    finally:
        signal.signal(signal.SIGINT, before)
