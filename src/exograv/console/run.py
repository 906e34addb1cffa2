"""The console from its command to its end: desk, protocol, diary, server."""

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
    """What is to be run: a protocol by its name or the path of a file; without one the machine is only steered.

    Raises:
        ConfigError: There is no such protocol, or the machine cannot make its levels.
    """
    if protocol is None:
        return None
    loaded = load_protocol(protocol)
    refuse_levels(loaded.settings, EARTH)
    return TaskPlan(loaded, loaded.settings.exo)


@dataclass(frozen=True)
class ConsoleResult:
    """Result of `exograv console`."""

    diary: Path
    refused_lines: dict[str, int]
    """By the reason."""

    totals: TotalsFigures | None = field(metadata=MERGED)
    """None where no protocol was run."""


def run_console(
    address: Address,
    folder: Path,
    desk: Desk,
    plan: TaskPlan | None,
    say: Say,
    kept: RunCheckpoint | None = None,
    receiver: AircraftReceiver | None = None,
) -> ConsoleResult:
    """Serve the pages until Ctrl-C, and say what was done.

    Raises:
        ConfigError: It cannot be served there, or what was kept is of another protocol.
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
            say(f"The aircraft is listened to on UDP port {receiver.port}.")
        if plan is not None:
            diary.write("/console/protocol", desk.now(), json_value(plan.loaded.recorded))
        if trial is not None and kept is not None and kept.before is not None:
            # The machine carries nothing of a run that was broken off: somebody has to begin anew, and say so.
            trial.run.feed(Interrupted(t=desk.now()))
        try:
            serve(hub, address, listening, host, say)
        finally:
            desk.close()  # before all else that has to be ended
    return ConsoleResult(path, hub.counts, None if trial is None else trial.run.totals().figures())
