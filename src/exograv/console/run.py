"""Run of a console, from its command to its end: desk, protocol, diary, server."""

import contextlib
import time
from dataclasses import dataclass, field
from pathlib import Path

from exograv.experiment.aircraft import AircraftReceiver
from exograv.experiment.steered.requests import Desk
from exograv.results import MERGED, json_value
from exograv.task.events import Interrupted
from exograv.task.levels import EARTH
from exograv.task.plan import TaskPlan
from exograv.task.protocol import load_protocol, refuse_levels
from exograv.task.totals import TotalsFigures

from .event_log import EventLog
from .feed import Feed
from .hub import Hub
from .options import Address
from .page_clocks import PageClocks
from .run_checkpoint import RunCheckpoint
from .serve import Say, bound, serve
from .trial import ProtocolTrial


def plan_of(protocol: str | None) -> TaskPlan | None:
    """Plan of a protocol, by its name or the path of a file; None without one: the machine is then only steered.

    Raises:
        ConfigError: The protocol does not exist, or the machine cannot produce its gravity levels.
    """
    if protocol is None:
        return None
    loaded = load_protocol(protocol)
    refuse_levels(loaded.settings, EARTH)
    return TaskPlan(loaded, loaded.settings.exo)


@dataclass(frozen=True)
class ConsoleResult:
    """Result of `exograv run console`."""

    diary: Path
    refused_lines: dict[str, int]
    """Number of refused lines by reason."""

    totals: TotalsFigures | None = field(metadata=MERGED)
    """Totals of the protocol; None without a protocol."""


def run_console(
    address: Address,
    folder: Path,
    desk: Desk,
    plan: TaskPlan | None,
    say: Say,
    kept: RunCheckpoint | None = None,
    receiver: AircraftReceiver | None = None,
) -> ConsoleResult:
    """Serve the pages until Ctrl-C, and return what was done.

    Raises:
        ConfigError: The address cannot be used, or the checkpoint belongs to another protocol.
    """
    path = folder / f"console-{time.strftime('%Y%m%d-%H%M%S')}.jsonl"
    clocks = PageClocks()
    with bound(address) as (listening, host), contextlib.ExitStack() as stack:
        stack.callback(desk.close)
        diary = EventLog(path, desk.write)
        stack.callback(diary.close)
        if kept is not None:
            stack.callback(kept.close)
        trial = None if plan is None else ProtocolTrial(plan, clocks, diary, kept)
        hub = Hub(desk, trial, clocks, diary, f"{address.scheme}://{host}")
        if receiver is not None and trial is not None:
            hub.feed = Feed(stack.enter_context(receiver), trial, diary)
            say(f"The console listens to the aircraft on UDP port {receiver.port}.")
        if plan is not None:
            diary.write("/console/protocol", desk.now(), json_value(plan.loaded.recorded))
        if trial is not None and kept is not None and kept.before is not None:
            # After an interruption the machine carries nothing: the operator must take the arm again, then resume.
            trial.run.feed(Interrupted(t=desk.now()))
        try:
            serve(hub, address, listening, host, say)
        finally:
            desk.close()  # The machine is stopped before anything else is closed.
    return ConsoleResult(path, hub.counts, None if trial is None else trial.run.totals().figures())
