"""One task of a sweep: frozen settings, and the key and the seed that follow from them and from nothing else."""

import hashlib
import json
from collections.abc import Callable, Iterator, Sequence
from dataclasses import asdict, dataclass, replace
from functools import cached_property
from typing import Annotated, Any, Literal

from exograv.model.rig_settings import Settings

Outcome = Literal["done", "failed", "lost"]
"""Done; failed by itself, which it would again; or given up because its worker was lost time after time."""

KEY_BITS = 128
SEED_BITS = 63  # fits a signed 64-bit column


@dataclass(frozen=True)
class SweepTask:
    """What is to be done once."""

    kind: str
    settings: Any
    """A frozen dataclass of plain values."""

    @cached_property
    def key(self) -> str:
        """The same settings have the same key, in every sweep and in every order."""
        text = json.dumps([self.kind, asdict(self.settings)], sort_keys=True, ensure_ascii=True)
        return hashlib.sha256(text.encode()).hexdigest()[: KEY_BITS // 4]

    @property
    def seed(self) -> int:
        """For whatever a task draws that its settings do not draw."""
        return int(self.key, 16) >> (KEY_BITS - SEED_BITS)


@dataclass(frozen=True)
class TaskBatch:
    """Tasks that one worker does one after the other, because they share work."""

    tasks: tuple[SweepTask, ...]
    losses: int = 0
    """How often a worker was lost with it."""

    @cached_property
    def key(self) -> str:
        """Of these tasks in this order."""
        return hashlib.sha256("".join(task.key for task in self.tasks).encode()).hexdigest()[: KEY_BITS // 4]

    def lost(self) -> "TaskBatch":
        """The same after one more loss."""
        return replace(self, losses=self.losses + 1)


@dataclass(frozen=True)
class Result:
    """What came of one task."""

    task: SweepTask
    outcome: Annotated[Outcome, "`done`, `failed` or `lost`"]
    values: Any = None
    """Dataclass of the kind's `results`; None where there is none."""

    error: Annotated[str | None, "why there is no result"] = None
    wall_s: Annotated[float, "since the batch's previous result: what is shared counts for the first"] = 0.0
    worker: Annotated[str, "computer"] = ""
    retries: Annotated[int, "how often its worker was lost before"] = 0


class Grid(Settings):
    """What stands under `[grid]` in a study's file; each kind of task has its own."""

    def __len__(self) -> int:
        """Number of tasks."""
        raise NotImplementedError

    def groups(self) -> Iterator[Sequence[Any]]:
        """Settings of all tasks, those that share work together; as they are asked for, never all at once."""
        raise NotImplementedError


Run = Callable[[Sequence[SweepTask]], Iterator[tuple[SweepTask, Any]]]
"""Does tasks of one group: each with its results, or with the sentence that says why there are none.

An exception of several tasks lets each run alone; an exception of one is its failure.
"""


@dataclass(frozen=True)
class TaskKind:
    """One kind of task: its grid, its rows, and what runs it."""

    name: str
    what: str
    """In a sentence."""

    grid: type[Grid]
    settings: type
    """Dataclass of a task's settings; its fields are columns of the table, and so are those of `results`."""

    results: type
    """Dataclass of what comes of a task, but for a failure."""

    person: tuple[str, ...]
    """Settings that tell one wearer from another: the planning table counts these."""

    run: Run


def each(run_one: Callable[[SweepTask], object]) -> Run:
    """A kind whose tasks share nothing."""

    def run(tasks: Sequence[SweepTask], /) -> Iterator[tuple[SweepTask, Any]]:
        for task in tasks:
            yield task, run_one(task)

    return run
