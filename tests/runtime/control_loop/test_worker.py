"""A worker's findings carry their time, a replaced worker loses no sample, and the end brings a final finding."""

import contextlib
import threading
from collections.abc import Iterator
from dataclasses import replace
from multiprocessing import Pipe

import numpy as np
import pytest

from exograv.runtime.control_loop.exchange import sample_dtype
from exograv.runtime.control_loop.worker import WorkerJob, WorkerMemory, _Desk, worker_process
from exograv.runtime.processes.shared_memory import Ring

SAMPLES_MAX = 100


class Counts:
    """Worker that counts its samples, and reports after each one."""

    def __init__(self):
        self.seen = 0
        self.is_over = True

    def take(self, sample: np.void) -> np.ndarray:
        self.seen += 1
        return np.array([float(self.seen)])

    def finish(self) -> tuple[np.ndarray, str]:
        return np.array([-1.0]), f"{self.seen} samples"


class Table:
    """Control's side of both rings, and a worker that works when told to."""

    def __init__(self, samples: Ring, findings: Ring, memory: WorkerMemory, stack: contextlib.ExitStack):
        self.samples, self.findings, self._memory, self._stack = samples, findings, memory, stack
        self._number = 0
        self.desk = self.new_worker()

    def new_worker(self) -> _Desk:
        rings = self._memory.sample_ring(), self._memory.finding_ring()
        for ring in rings:
            self._stack.callback(ring.close)
        self.desk = _Desk(WorkerJob(Counts, self._memory), *rings)
        return self.desk

    def tell(self, count: int, is_last: bool = False) -> None:
        row = np.zeros((), sample_dtype(1))
        for _ in range(count):
            self._number += 1
            row["now"] = self._number
            self.samples.put(row)
        if is_last:
            row["is_last"] = 1
            self.samples.put(row)

    def found(self) -> list[float]:
        return [float(row["x"][0]) for row in self.findings.take()]


@pytest.fixture
def table() -> Iterator[Table]:
    size = WorkerMemory(1, 1, SAMPLES_MAX)
    with contextlib.ExitStack() as stack:
        samples, findings = size.sample_ring(), size.finding_ring()
        memory = replace(size, samples=samples.name, findings=findings.name)
        stack.callback(samples.close)
        stack.callback(findings.close)
        yield Table(samples, findings, memory, stack)


def test_a_finding_has_the_time_of_its_sample(table: Table):
    table.tell(3)
    assert not table.desk.work()
    newest = table.findings.newest()
    assert newest is not None
    assert (newest[0], newest[1]["now"], newest[1]["x"][0]) == (3, 3.0, 3.0)


def test_a_replacement_worker_begins_with_the_first_sample(table: Table):
    table.tell(5)
    table.desk.work()
    table.tell(2)
    table.new_worker().work()
    assert table.found() == [1, 2, 3, 4, 5, 1, 2, 3, 4, 5, 6, 7]


def test_the_last_sample_brings_the_final_finding_and_message_once(table: Table):
    table.tell(4, is_last=True)
    assert table.desk.work() == ["5 samples"]
    assert table.found()[-1] == -1.0
    table.tell(1, is_last=True)
    assert not table.desk.work()
    assert table.found() == []


def test_many_readers_can_read_the_newest_finding_without_taking_it(table: Table):
    assert table.findings.newest() is None
    table.tell(2)
    table.desk.work()
    assert table.findings.newest() == table.findings.newest()
    assert table.found() == [1.0, 2.0]


def test_the_process_of_a_worker_is_ready_works_and_ends_with_its_parent():
    size = WorkerMemory(1, 1, SAMPLES_MAX)
    with contextlib.ExitStack() as stack:
        samples, findings = (
            stack.enter_context(contextlib.closing(ring)) for ring in (size.sample_ring(), size.finding_ring())
        )
        job = WorkerJob(Counts, replace(size, samples=samples.name, findings=findings.name))
        row = np.zeros((), sample_dtype(1))
        row["is_last"] = 1
        samples.put(row)
        ours, its = Pipe()
        thread = threading.Thread(target=worker_process, args=(job, its))
        thread.start()
        assert [ours.recv(), ours.recv()] == ["ready", "1 samples"]
        ours.close()
        thread.join(30.0)
        assert not thread.is_alive()
        assert [float(row["x"][0]) for row in findings.take()] == [-1.0]
