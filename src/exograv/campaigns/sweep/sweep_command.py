"""`exograv dev sweep`: run the remaining tasks. Several workers may do so. Finished tasks survive an interruption."""

import time
from collections import Counter, deque
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from exograv.loop.pilot import Progress

from .options import SweepOptions
from .runner import LOSSES_MAX, FinishedBatch, LostBatch, Runner
from .store import Store
from .study_file import Study
from .task import Result, TaskBatch

FLUSH_S = 5.0
"""Longest time between two part files [s]; each is flushed to the disk."""


class SweepRun:
    """State of one sweep: remaining tasks, results, and tasks to run again."""

    def __init__(self, study: Study, store: Store, options: SweepOptions, progress: Progress):
        self._store, self._progress = store, progress
        self._again: deque[TaskBatch] = deque()
        k, n = options.share
        self._fresh = self._left(batch for batch in study.batches() if int(batch.key, 16) % n == k)
        self._total = sum(len(batch.tasks) for batch in study.batches()) if n == 1 else 0
        self._losses: Counter[str] = Counter()
        self._open: list[Result] = []
        self._begin = self._flushed = time.perf_counter()
        self.ran = self.retried = 0
        self.busy_s = 0.0
        self.given_up: set[str] = set()
        """Keys of tasks that were given up after several lost workers."""

    def work_off(self, runner: Runner) -> None:
        """Run all remaining tasks. Finished tasks are kept if it is interrupted."""
        events = runner.run(self._take)
        try:
            for event in events:
                if isinstance(event, FinishedBatch):
                    self._keep(event.results)
                elif isinstance(event, LostBatch):
                    self._run_again(event.batch)
                else:
                    self.retried += event.tasks
                if time.perf_counter() - self._flushed > FLUSH_S:
                    self.flush()
        finally:
            events.close()
            self.flush()

    def flush(self) -> None:
        """Write the results since the last flush to the disk."""
        if self._open:
            results, self._open = self._open, []
            self._store.add(results, TaskBatch(tuple(result.task for result in results)).key)
        self._flushed = time.perf_counter()

    def _left(self, batches: Iterator[TaskBatch]) -> Iterator[TaskBatch]:
        for batch in batches:
            tasks = tuple(task for task in batch.tasks if task.key not in self._store.done)
            if tasks:
                yield replace(batch, tasks=tasks)

    def _take(self) -> TaskBatch | None:
        return self._again.popleft() if self._again else next(self._fresh, None)

    def _keep(self, results: Sequence[Result]) -> None:
        for result in results:
            self._open.append(replace(result, retries=result.retries + self._losses[result.task.key]))
            self.ran += 1
            self.busy_s += result.wall_s
        done = len(self._store.done) + len(self._open)
        rate = self.ran / max(time.perf_counter() - self._begin, 1e-9)
        told = f"{done} of {self._total} tasks, {rate:.2g} tasks/s, {_time((self._total - done) / rate)} left"
        self._progress(
            told if self._total else f"{done} tasks, {rate:.2g} tasks/s", min(1.0, done / max(1, self._total))
        )

    def _run_again(self, batch: TaskBatch) -> None:
        batch = batch.lost()
        self._losses.update(task.key for task in batch.tasks)
        # A single loss may be chance. After a second one each task runs alone, to show which one ends the workers.
        alone = batch.losses > 1 and len(batch.tasks) > 1
        pieces = [replace(batch, tasks=(task,)) for task in batch.tasks] if alone else [batch]
        for piece in pieces:
            if piece.losses >= LOSSES_MAX:
                told = f"Its worker was lost {piece.losses} times: no memory left, or the task ends the worker."
                self.given_up.update(task.key for task in piece.tasks)
                self._keep([Result(task, "lost", error=told) for task in piece.tasks])
            else:
                self.retried += len(piece.tasks)
                self._again.append(piece)


def _time(seconds: float) -> str:
    if seconds < 90:
        return f"{max(seconds, 0.0):.0f} s"
    return f"{seconds / 60:.0f} min" if seconds < 5400 else f"{seconds / 3600:.1f} h"


@dataclass(frozen=True)
class SweepResult:
    """Result of `exograv dev sweep`."""

    tasks: int
    done: int
    failed: int
    retried: int
    """Number of tasks that ran again because their worker was lost."""

    wall_s: float
    table: Path | None
    """Table of results; None for a share of a sweep."""

    times: Path | None
    lost: int
    """Number of tasks that were given up."""

    before: int
    """Number of tasks that an earlier command finished."""

    ran: int
    busy_s: float
    tasks_per_s: float | None
    runner: str
    workers: int
    interrupted: bool


def run_sweep(study: Study, options: SweepOptions, folder: Path, progress: Progress) -> SweepResult:
    """Run the remaining tasks and write the tables.

    Raises:
        ConfigError: The cluster cannot be used.
        RecordingError: The folder cannot be used.
    """
    start = time.perf_counter()
    store, runner, interrupted = Store(folder, study.kind), options.runner(), False
    before = len(store.done)
    sweep = SweepRun(study, store, options, progress)
    try:
        sweep.work_off(runner)
    except KeyboardInterrupt:
        interrupted = True
    worked_s = time.perf_counter() - start
    keys = {task.key for batch in study.batches() for task in batch.tasks}
    outcomes = Counter(store.done[key] for key in keys if key in store.done)
    lost = len(sweep.given_up & keys)
    table = times = None
    if options.part is None:
        store.compact()
        table, times = store.write_tables(study, keys)
    return SweepResult(
        tasks=len(keys),
        done=outcomes["done"],
        failed=outcomes["failed"] + lost,
        retried=sweep.retried,
        wall_s=round(time.perf_counter() - start, 3),
        table=table,
        times=times,
        lost=lost,
        before=before,
        ran=sweep.ran,
        busy_s=round(sweep.busy_s, 3),
        tasks_per_s=round(sweep.ran / worked_s, 4) if sweep.ran else None,
        runner=runner.name,
        workers=runner.workers,
        interrupted=interrupted,
    )
