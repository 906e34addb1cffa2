"""Process of the pages: it serves them, and reaches the machine only by requests to the guard's parent.

Strangers can reach this process. It has descriptors, memory and an interpreter of its own: a flood, an endless loop or
a crash here does not stop the parent.
"""

import contextlib
import os
import socket
import sys
import threading
from dataclasses import dataclass
from multiprocessing.connection import Connection
from pathlib import Path
from typing import TYPE_CHECKING

from exograv.results import json_value
from exograv.task.events import Interrupted
from exograv.task.run_statement import STATEMENT_TOPIC

from .desk_link import DeskClient, Ended, LinkNames, Ready
from .event_log import EventLog
from .feed import Feed
from .hub import Hub
from .keys import SESSION_S, AccessKeys, Role
from .options import Address
from .page_clocks import PageClocks
from .serve import PageServer, settings_of
from .trial import ProtocolTrial
from .trial_request import TrialRequest

if TYPE_CHECKING or sys.platform != "win32":
    import resource  # not on Windows

DESCRIPTORS_MAX = 320
"""Descriptors of the process: 236 for connections (`door`), the rest for files, rings and the interpreter."""

LOGINS_PER_PROCESS = 1000
"""Number of login numbers that each process may assign; the next process begins after them."""


@dataclass(frozen=True)
class PageJob:
    """Job of one process of the pages."""

    names: LinkNames
    address: Address
    listening: socket.socket
    """Socket of the parent, which stays open when this process ends: pages wait for the next one."""

    host: str
    diary: Path
    trial: TrialRequest
    cookie_key: bytes
    operator_token: str
    """Token of the link that the parent shows."""

    number: int = 0
    """Number of processes before this one."""


def serve_pages(job: PageJob, line: Connection) -> None:
    """Serve the pages until the parent closes `line`. A programming error ends the process with exit status 1."""
    _limit_descriptors()
    desk = DeskClient(job.names)
    with contextlib.ExitStack() as stack:
        hub = _hub(job, desk, stack)
        server = PageServer(settings_of(hub, job.address, job.host), hub)

        def failed() -> None:
            # The pages connect again to the next process; no farewell may tell them that the session is over.
            server.says_farewell, server.should_exit = False, True

        def end_with_parent() -> None:
            with contextlib.suppress(EOFError, OSError):
                line.recv()
            server.should_exit = True

        hub.on_failure = failed
        threading.Thread(target=end_with_parent, daemon=True).start()
        desk.send(Ready(aircraft_port=None if hub.feed is None else hub.feed.port))
        server.run(sockets=[job.listening])
        totals = None if hub.trial is None else json_value(hub.trial.run.totals().figures())
        counts, failure = dict(hub.counts), hub.failure
    if failure is None:
        desk.send(Ended(refused_lines=counts, totals=totals))
    else:
        sys.excepthook(type(failure), failure, failure.__traceback__)
    sys.stderr.flush()
    # Threads may wait for an answer of a parent that has ended.
    os._exit(0 if failure is None else 1)


def _hub(job: PageJob, desk: DeskClient, stack: contextlib.ExitStack) -> Hub:
    """Build the console's state; `stack` closes its files."""
    is_restart = job.number > 0
    clocks = PageClocks()
    diary = EventLog(job.diary, desk.write, continues=is_restart)
    stack.callback(diary.close)
    plan, kept, stated = job.trial.plan(), job.trial.checkpoint(is_restart), job.trial.stated()
    if kept is not None:
        kept.sync_before = diary.sync
        stack.callback(kept.close)
    statement = None if stated is None else stated.now()
    if statement is not None:
        # Records before this line that are later than the checkpoint are not known to the run.
        diary.write(STATEMENT_TOPIC, desk.now(), json_value(statement))
    trial = None if plan is None else ProtocolTrial(
        plan, clocks, diary, kept, may_be_over=is_restart, statement=statement
    )  # fmt: skip
    keys = AccessKeys(desk.now, job.cookie_key, LOGINS_PER_PROCESS * job.number)
    keys.admit(job.operator_token, Role.OPERATOR, SESSION_S)
    hub = Hub(desk, trial, clocks, diary, f"{job.address.scheme}://{job.host}", keys)
    receiver = job.trial.receiver(plan)
    if receiver is not None and trial is not None:
        hub.feed = Feed(stack.enter_context(receiver), trial, diary)
    if plan is not None and not is_restart:
        diary.write("/console/protocol", desk.now(), json_value(plan.loaded.recorded))
    if trial is not None and kept is not None and kept.before is not None:
        # After an interruption the operator must look at the machine first, then resume.
        trial.run.feed(Interrupted(t=desk.now()))
    return hub


def _limit_descriptors() -> None:
    if sys.platform != "win32":
        _, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
        most = DESCRIPTORS_MAX if hard == resource.RLIM_INFINITY else min(DESCRIPTORS_MAX, hard)
        resource.setrlimit(resource.RLIMIT_NOFILE, (most, most))
