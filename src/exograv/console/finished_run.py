"""End of an interrupted run whose windows are all complete: it needs neither machine nor person."""

import time
from dataclasses import dataclass
from pathlib import Path

from exograv.errors import ConfigError
from exograv.results import json_value
from exograv.task.events import Interrupted, Resume
from exograv.task.plan import TaskPlan
from exograv.task.run import TaskRun
from exograv.task.run_statement import STATEMENT_TOPIC
from exograv.task.totals import TotalsFigures

from .event_log import EventLog
from .page_clocks import PageClocks
from .run import diary_path
from .run_checkpoint import RunCheckpoint
from .trial import ProtocolTrial
from .trial_request import TrialRequest


@dataclass(frozen=True)
class EndedRun:
    """Run that is over."""

    is_finished: bool
    """True if the protocol has come to its end, False if an operator has stopped it."""

    totals: TotalsFigures


def ended_run(request: TrialRequest, report: Path) -> EndedRun | None:
    """End a run that is resumed with all of its windows complete, and return its result. None if the run goes on.

    Args:
        request: Protocol and person.
        report: Report of the session, which the caller writes afterwards.

    Raises:
        ConfigError: The run is over and has its report, or its checkpoint cannot be used.
        RecordingError: The diary cannot be written.
    """
    plan = request.plan()
    kept = request.checkpoint() if request.resumes else None
    if kept is None or kept.before is None or plan is None:
        return None
    try:
        run = TaskRun.from_kept(plan, kept.before.run)
        is_over = run.state.status in ("stopped", "finished")
        if is_over and report.exists() and report.stat().st_mtime >= kept.path.stat().st_mtime:
            raise ConfigError(
                f"The run in {kept.path} is over and has its report, {report}. Start the next session with --session."
            )
        if is_over:
            return EndedRun(run.state.status == "finished", run.totals().figures())
        if not run.state.complete >= set(plan.protocol.windows.numbers):
            return None
        return _ended(plan, kept, request)
    finally:
        kept.close()


def _ended(plan: TaskPlan, kept: RunCheckpoint, request: TrialRequest) -> EndedRun:
    """End the run, and write its end into checkpoint and a new diary."""
    stated, t = request.stated(), time.monotonic()
    diary = EventLog(diary_path(request.folder), lambda *_: None)
    try:
        statement = None if stated is None else stated.now()
        if statement is not None:
            diary.write(STATEMENT_TOPIC, t, json_value(statement))
        kept.sync_before = diary.sync
        trial = ProtocolTrial(plan, PageClocks(), diary, kept, statement=statement)
        for event in (Interrupted(t=t), Resume(t=t)):
            trial.run.feed(event)
        kept.close()  # before the diary
    finally:
        diary.close()
    return EndedRun(trial.run.state.status == "finished", trial.run.totals().figures())
