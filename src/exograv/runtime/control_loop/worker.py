"""Worker process for computations longer than a tick, which reads samples of control and returns findings.

Samples wait in a ring that holds a whole motion, so control never waits for a worker. If a worker dies, another one
starts again from the first sample. Findings go into a second ring, with the time of their sample, and control takes the
newest. So a worker that is slow, or catches up, delays no other process.
"""

from collections.abc import Callable
from dataclasses import dataclass
from multiprocessing.connection import Connection
from typing import Any, Protocol, runtime_checkable

import numpy as np

from exograv.runtime.clock.free_memory import return_free_memory
from exograv.runtime.processes.shared_memory import Ring

from .exchange import finding_dtype, sample_dtype

LOOKS_EVERY_S = 0.025
"""Time between two looks for samples [s]."""

FINDINGS_MAX = 1 << 13
"""Capacity of the ring of findings: half an hour at five a second, far more than the ring of samples lasts."""


@runtime_checkable
class WorkerInterface(Protocol):
    """Interface of a worker for its process."""

    def take(self, sample: np.void) -> np.ndarray | None:
        """Take one sample; return a finding if it is time for one."""
        ...

    def finish(self) -> tuple[np.ndarray, Any]:
        """End a motion after its last sample; return the final finding, and a message for the parent."""
        ...

    @property
    def is_over(self) -> bool:
        """True if no motion follows the one that was finished last."""
        ...


@runtime_checkable
class ReportingWorker(Protocol):
    """Worker that reports its progress to the parent."""

    def news(self) -> list[Any]:
        """Return the messages for the parent since the last call."""
        ...


@dataclass(frozen=True)
class WorkerMemory:
    """Rings of a worker, by name if another process has made them."""

    joints: int
    parameters: int
    samples_max: int
    samples: str | None = None
    findings: str | None = None

    def sample_ring(self) -> Ring:
        """Return the ring from control to the worker."""
        return Ring(sample_dtype(self.joints), self.samples_max, self.samples)

    def finding_ring(self) -> Ring:
        """Return the ring from the worker to control and to the parent."""
        return Ring(finding_dtype(self.parameters), FINDINGS_MAX, self.findings, is_lazy=True)


@dataclass(frozen=True)
class WorkerJob:
    """Start arguments of a worker."""

    build: Callable[[], WorkerInterface]
    memory: WorkerMemory


def worker_process(job: WorkerJob, parent: Connection) -> None:
    """Run the worker, until the parent ends the run or is gone."""
    samples, findings = job.memory.sample_ring(), job.memory.finding_ring()
    try:
        desk = _Desk(job, samples, findings)
        return_free_memory()
        parent.send("ready")
        while not parent.poll(LOOKS_EVERY_S):
            for word in desk.work():
                parent.send(word)
    finally:
        samples.close()
        findings.close()


class _Desk:
    """Work of the process between the ring of samples and the ring of findings."""

    def __init__(self, job: WorkerJob, samples: Ring, findings: Ring):
        self._working, self._samples, self._findings = job.build(), samples, findings
        self._row = np.zeros((), finding_dtype(job.memory.parameters))
        self._is_done = False

    def work(self) -> list[Any]:
        """Take new samples; return the messages for the parent, with one for each motion that has ended."""
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
        if not np.isfinite(found).all():
            return
        self._row["now"], self._row["x"] = sample["now"], found
        self._findings.put(self._row)
