"""The parent's side of a worker: it is started, replaced when it dies, and what it finds is recorded and passed on."""

from collections.abc import Callable, Mapping
from typing import Any

from exograv.runtime.control_loop.worker import WorkerJob, worker_process
from exograv.runtime.processes.shared_memory import Ring
from exograv.runtime.processes.supervisor import Supervisor

from .arm_worker import EstimateReport, LearnedArm, PassesResult

RESTARTS_MAX = 3
"""Workers that are replaced; what ends so many would end the next one too."""

Record = Callable[[str, float, Mapping[str, Any]], object]


class WorkerKeeper:
    """One worker after another, until the arm is learned."""

    def __init__(
        self, job: WorkerJob, findings: Ring, record: Record, accept: Callable[[LearnedArm | PassesResult], object]
    ):
        """Start the first.

        Args:
            job: What each is started with.
            findings: The parent's own, of which `job` has the name.
            record: Takes topic, time [s] and message of what control was given.
            accept: Told what was learned in the end, and that a verification's passes have been flown.
        """
        self._job, self._findings, self._record, self._accept = job, findings, record, accept
        self.learned: LearnedArm | None = None
        self.passed: PassesResult | None = None
        self.judged: EstimateReport | None = None
        """How far it is."""
        self._child = Supervisor("worker", worker_process, job, RESTARTS_MAX)

    @property
    def pid(self) -> int:
        """Identifier of the worker in charge."""
        return self._child.pid

    @property
    def restarts(self) -> int:
        """Workers that had to be replaced."""
        return self._child.restarts

    def await_ready(self) -> None:
        """Wait until the worker has built what it needs.

        Raises:
            RigError: The worker has died, or takes too long.
        """
        self._child.await_ready()

    @property
    def findings(self) -> int:
        """Number of findings so far."""
        return self._findings.written

    def check(self) -> None:
        """Pass on what is new, and start another worker if this one has died. To be called some times a second."""
        self.note()
        if self._is_over:
            return
        for word in self._child.heard():
            self._hear(word)
        if not self._is_over and not self._child.is_alive:
            self._child.replace(self._job)

    def note(self) -> None:
        """Have what is new recorded."""
        for row in self._findings.take():
            self._record("/control", float(row["now"]), {"act": "publish", "x": row["x"].tolist()})

    def close(self) -> None:
        """Say that it is over."""
        self._child.end(2.0, "over")

    def _hear(self, word: object) -> None:
        # One that follows on another learns all anew; the guard knows the person already.
        if isinstance(word, EstimateReport):
            self.judged = word
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
