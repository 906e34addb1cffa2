"""The final result of a worker is passed on once, although a replacement learns everything again."""

from dataclasses import replace
from multiprocessing import Pipe
from typing import Any

import numpy as np
import pytest

from exograv.identification.core.carried_arm import CarriedArm
from exograv.identification.core.interface import Estimate, Outcome
from exograv.live.arm_worker import EstimateReport, LearnedArm, PassesResult
from exograv.live.worker_supervisor import WorkerKeeper
from exograv.runtime.control_loop.worker import WorkerJob, WorkerMemory
from exograv.safety.limits import PersonLimits
from exograv.safety.plausible import LimbTable, PlausibleTable

NOTHING, WIDE, FREE, ZERO = np.zeros((1, 3)), np.full(1, 30.0), np.full(1, 3.0), np.zeros(1)
PERSON = PersonLimits(PlausibleTable((LimbTable((0,), 1, NOTHING, NOTHING),), WIDE, WIDE, WIDE), WIDE, -FREE, FREE)
ESTIMATE = Estimate(1.0, np.zeros(1), None, 0.0, 1.0)
CARRIED = CarriedArm(ESTIMATE.x, None, *np.ones((5, 1)))
LEARNED = LearnedArm(1.0, ESTIMATE, CARRIED, Outcome.TIME_IS_UP, "", None, None, PERSON)
PASSED = PassesResult(2.0, (), 1.0, PERSON)
REPORT = EstimateReport(1.0, ZERO, ZERO, ZERO, ZERO, ZERO, ZERO)


class Process:
    """Mock of a worker process that dies on demand."""

    pid = 1

    def __init__(self):
        self.lives = True

    def is_alive(self) -> bool:
        return self.lives

    @property
    def exitcode(self) -> int | None:
        return None if self.lives else 0

    def join(self, _patience_s: float) -> None:
        self.lives = False


def unbuilt() -> Any:
    raise AssertionError("nobody is started here")


@pytest.mark.parametrize("refused", [{"is_contradicted": True}, {"refusal": "The form belongs to another adult."}])
def test_an_arm_that_contradicts_its_file_or_form_is_never_given_to_the_guard(
    refused: dict[str, Any], monkeypatch: pytest.MonkeyPatch
):
    monkeypatch.setattr("exograv.runtime.processes.supervisor.spawned", lambda *_: (Process(), ours))
    ours, its = Pipe()
    memory, heard = WorkerMemory(1, 1, 10), list[object]()
    findings = memory.finding_ring()
    keeper = WorkerKeeper(WorkerJob(unbuilt, memory), findings, lambda *_: None, heard.append)
    for word in (REPORT, replace(REPORT, **refused), LEARNED):
        its.send(word)
    keeper.check()
    keeper.close()
    findings.close()
    assert keeper.judged == replace(REPORT, **refused)
    assert keeper.learned is None
    assert heard == []


@pytest.mark.parametrize(
    ("words", "is_led", "restarts"),
    [
        ([[LEARNED]], [False], 0),
        ([[replace(LEARNED, is_led=True)], [replace(LEARNED, is_led=True), PASSED]], [True, False], 1),
        ([[replace(LEARNED, is_led=True), PASSED]], [True, False], 0),
        ([[REPORT, LEARNED]], [False], 0),
    ],
)
def test_each_word_is_passed_on_once(
    words: list[list[Any]], is_led: list[bool], restarts: int, monkeypatch: pytest.MonkeyPatch
):
    started, heard = [], []

    def spawned(*_: object) -> tuple[Process, Any]:
        ours, its = Pipe()
        for word in words[len(started)]:
            its.send(word)
        started.append((Process(), ours, its))
        return started[-1][0], ours

    monkeypatch.setattr("exograv.runtime.processes.supervisor.spawned", spawned)
    memory = WorkerMemory(1, 1, 10)
    findings = memory.finding_ring()
    keeper = WorkerKeeper(WorkerJob(unbuilt, memory), findings, lambda *_: None, heard.append)
    for _ in range(3):
        keeper.check()
        started[-1][0].lives = False
        keeper.check()
    keeper.close()
    findings.close()
    assert [word.is_led for word in heard] == is_led
    assert keeper.restarts == restarts
