"""A process for what takes longer than a tick: it listens to control's samples, and tells what it finds when it can.

Samples wait in a ring that holds all of a motion, so that control never waits for a worker, and a worker that dies is
followed by one that begins anew with the first of them. What it finds goes into another ring with the time of its
sample, and control takes the newest: a worker that is slow, or catches up, holds up nobody.
"""

from collections.abc import Callable
from dataclasses import dataclass
from multiprocessing.connection import Connection
from typing import Any, Protocol, runtime_checkable

import numpy as np

from exograv.runtime.processes.shared_memory import Ring

from .exchange import finding_dtype, sample_dtype

LOOKS_EVERY_S = 0.025
"""Between two looks for samples."""

FINDINGS_MAX = 1 << 15
"""At five a second nearly two hours."""


@runtime_checkable
class WorkerInterface(Protocol):
    """What a worker does, as the process around it sees it."""

    def take(self, sample: np.void) -> np.ndarray | None:
        """Take one sample; what is found by it, if it is time to tell."""
        ...

    def finish(self) -> tuple[np.ndarray, Any]:
        """After the last sample of a motion: what is found in the end, and what the parent is to know of it."""
        ...

    @property
    def is_over(self) -> bool:
        """Whether no other motion follows the one that was finished last."""
        ...


@runtime_checkable
class ReportingWorker(Protocol):
    """A worker that tells its parent how far it is."""

    def news(self) -> list[Any]:
        """What the parent may show, since this was last asked."""
        ...


@dataclass(frozen=True)
class WorkerMemory:
    """The two rings of a worker, by name where another process has made them."""

    joints: int
    parameters: int
    samples_max: int
    samples: str | None = None
    findings: str | None = None

    def sample_ring(self) -> Ring:
        """From control to the worker."""
        return Ring(sample_dtype(self.joints), self.samples_max, self.samples)

    def finding_ring(self) -> Ring:
        """From the worker to control and to the parent."""
        return Ring(finding_dtype(self.parameters), FINDINGS_MAX, self.findings)


@dataclass(frozen=True)
class WorkerJob:
    """What a worker is started with."""

    build: Callable[[], WorkerInterface]
    memory: WorkerMemory


def worker_process(job: WorkerJob, parent: Connection) -> None:
    """Be the worker: until the parent says that the run is over, or is gone."""
    samples, findings = job.memory.sample_ring(), job.memory.finding_ring()
    try:
        desk = _Desk(job, samples, findings)
        parent.send("ready")
        while not parent.poll(LOOKS_EVERY_S):
            for word in desk.work():
                parent.send(word)
    finally:
        samples.close()
        findings.close()


class _Desk:
    """Samples on one side, findings on the other."""

    def __init__(self, job: WorkerJob, samples: Ring, findings: Ring):
        self._working, self._samples, self._findings = job.build(), samples, findings
        self._row = np.zeros((), finding_dtype(job.memory.parameters))
        self._is_done = False

    def work(self) -> list[Any]:
        """Take what is new; what the parent is to know of each motion that has come to its end with it."""
        words = []
        for sample in () if self._is_done else self._samples.take():
            found = self._working.take(sample)
            if sample["is_last"]:
                found, word = self._working.finish()
                words.append(word)
            if found is not None:
                self._put(sample, found)
            if sample["is_last"] and self._working.is_over:
                self._is_done = True
                break
        return [*self._working.news(), *words] if isinstance(self._working, ReportingWorker) else words

    def _put(self, sample: np.void, found: np.ndarray) -> None:
        self._row["now"], self._row["x"] = sample["now"], found
        self._findings.put(self._row)
