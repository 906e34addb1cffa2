"""Supervisor of the worker process in its parent: it starts and replaces the worker, and records its findings."""

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from exograv.runtime.control_loop.worker import WorkerJob, worker_process
from exograv.runtime.processes.shared_memory import Ring
from exograv.runtime.processes.supervisor import Supervisor

from .arm_worker import EstimateReport, LearnedArm, PassesResult

RESTARTS_MAX = 3
"""Largest number of workers that are replaced; the same cause would also end the next worker."""

Record = Callable[[str, float, Mapping[str, Any]], object]
"""Callback that records a message: topic, time [s] and content."""


class WorkerKeeper:
    """Supervisor that replaces the worker process when it ends unexpectedly, until the arm is learned."""

    def __init__(
        self, job: WorkerJob, findings: Ring, record: Record, accept: Callable[[LearnedArm | PassesResult], object]
    ):
        """Start the first worker.

        Args:
            job: Parameters of each worker.
            findings: The parent's handle of the findings; `job` has the name of this memory.
            record: Function that records what control was given.
            accept: Function that is called with the learned arm, and with the passes of a verification.
        """
        self._job, self._findings, self._record, self._accept = job, findings, record, accept
        self.learned: LearnedArm | None = None
        self.passed: PassesResult | None = None
        self.judged: EstimateReport | None = None
        """Newest report of the worker."""
        self._child = Supervisor("worker", worker_process, job, RESTARTS_MAX)

    @property
    def pid(self) -> int:
        """Identifier of the worker in charge."""
        return self._child.pid

    @property
    def restarts(self) -> int:
        """Number of workers that were replaced."""
        return self._child.restarts

    def await_ready(self) -> None:
        """Wait until the worker has built what it needs.

        Raises:
            RigError: The worker has died, or takes too long.
        """
        self._child.await_ready()

    @property
    def findings(self) -> int:
        """Number of findings that the worker has reported."""
        return self._findings.written

    def check(self) -> None:
        """Pass on new findings, and replace the worker if it has died. Call this several times a second."""
        self.note()
        if self._is_over:
            return
        for word in self._child.heard():
            self._hear(word)
        if not self._is_over and not self._child.is_alive:
            self._child.replace(self._job)

    def note(self) -> None:
        """Record the new findings. Control ignores one that is not finite, too."""
        for row in self._findings.take():
            if not (np.isfinite(row["now"]) and np.isfinite(row["x"]).all()):
                continue
            self._record("/control", float(row["now"]), {"act": "publish", "x": row["x"].tolist()})

    def close(self) -> None:
        """End the worker process."""
        self._child.end(2.0, "over")

    @property
    def is_refused(self) -> bool:
        """True if the motion contradicts the person's file or form: the arm is then never given to the guard."""
        return self.judged is not None and (self.judged.is_contradicted or bool(self.judged.refusal))

    def _hear(self, word: object) -> None:
        # A replacement worker learns everything again. The guard has the person's limits already.
        if isinstance(word, EstimateReport):
            self.judged = word
        elif self.is_refused:
            return  # The last judgement can come with the end of the motion, before the arm is let down.
        elif isinstance(word, LearnedArm) and self.learned is None:
            self.learned = word
            self._accept(word)
        elif isinstance(word, PassesResult) and self.passed is None:
            self.passed = word
            self._accept(word)

    @property
    def _is_over(self) -> bool:
        newest = self.passed or self.learned
        return newest is not None and not newest.is_led
