"""Work on a batch. A task that raises an exception gives a result too."""

import platform
import time
from collections.abc import Iterator, Sequence

from exograv.loop.replay_log import versions

from .kinds import KINDS
from .task import Result, SweepTask


def work_off(tasks: Sequence[SweepTask], worker: str = "") -> Iterator[Result]:
    """Run all tasks of a batch. Yield each result as it is finished."""
    left = {task.key: task for task in tasks}
    before = time.perf_counter()
    try:
        for task, found in KINDS[tasks[0].kind].run(tasks):
            now = time.perf_counter()
            wall_s, before = now - before, now
            del left[task.key]
            if isinstance(found, str):
                yield Result(task, "failed", error=found, wall_s=wall_s, worker=worker)
            else:
                yield Result(task, "done", found, wall_s=wall_s, worker=worker)
    except Exception as error:  # noqa: BLE001 - a failed task must not end the other tasks of a large sweep
        wall_s = time.perf_counter() - before
        told = f"{type(error).__name__}: {error}"
    else:
        told, wall_s = "The kind of task gave no result for it.", 0.0
    if len(tasks) == 1:
        for task in left.values():
            yield Result(task, "failed", error=told, wall_s=wall_s, worker=worker)
    else:
        # Each task runs alone again, to show which one raised the exception.
        for task in left.values():
            yield from work_off([task], worker)


def place() -> str:
    """Name of this computer, for the table."""
    return platform.node() or "unknown"


def same_versions(expected: dict[str, str]) -> str | None:
    """Sentence about packages in which this worker differs; None if there are none."""
    ours = versions()
    other = [name for name in expected if ours.get(name) != expected[name]]
    if not other:
        return None
    shown = ", ".join(f"{name} {_short(ours.get(name))} in place of {_short(expected[name])}" for name in other)
    return f"worker on {place()} has {shown}"


def _short(value: str | None) -> str:
    return "none" if value is None else value[:12]
