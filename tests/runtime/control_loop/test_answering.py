"""Control reports that it is ready only then: the guard begins with this message, and asks at once."""

import contextlib
from collections.abc import Iterator
from multiprocessing import Pipe

import numpy as np
import pytest

from exograv.runtime.control_loop.answering import ControlJob, control_process
from exograv.runtime.control_loop.exchange import Channels, answer_dtype, state_dtype
from exograv.runtime.processes.shared_memory import Mailbox
from exograv.runtime.recorder.recorder_process import Inlet


class Silent:
    """Control that must not be asked."""

    mode_names = ()

    def answer(self, state: np.void, row: np.ndarray) -> None:
        raise AssertionError("nobody has asked")


def test_control_says_that_it_is_ready_when_it_has_its_rights(monkeypatch: pytest.MonkeyPatch):
    ours, its = Pipe()
    ours.send("over")
    said_before: list[bool] = []

    @contextlib.contextmanager
    def rights(_cpu: int) -> Iterator[None]:
        said_before.append(ours.poll())
        yield
        said_before.append(ours.poll())

    monkeypatch.setattr("exograv.runtime.control_loop.answering.realtime", rights)
    states, answers = Mailbox(state_dtype(1)), Mailbox(answer_dtype(1))
    with contextlib.closing(states), contextlib.closing(answers):
        channels = Channels(1, states.name, answers.name, Inlet(1, "", "", ""))
        control_process(ControlJob(Silent, channels), its)
    assert said_before == [False, True]
    assert ours.recv() == "ready"


@pytest.fixture
def without_rights(monkeypatch: pytest.MonkeyPatch) -> None:
    """Leave the memory of the tests' process unlocked."""
    monkeypatch.setattr("exograv.runtime.control_loop.answering.realtime", lambda _cpu: contextlib.nullcontext())


class Posed(Silent):
    """Control that wants to know the posture before it answers."""

    def __init__(self, prepared: list[float]):
        self._prepared = prepared

    def prepare(self, state: np.void) -> None:
        self._prepared.append(float(state["q"][0]))


@pytest.mark.usefixtures("without_rights")
def test_control_prepares_for_the_posture_of_the_machine_before_it_says_that_it_is_ready():
    ours, its = Pipe()
    prepared: list[float] = []
    states, answers = Mailbox(state_dtype(1)), Mailbox(answer_dtype(1))
    with contextlib.closing(states), contextlib.closing(answers):
        state = np.zeros((), state_dtype(1))
        state["q"] = 0.3
        states.write(state)
        ours.send("over")
        channels = Channels(1, states.name, answers.name, Inlet(1, "", "", ""))
        control_process(ControlJob(lambda: Posed(prepared), channels), its)
    assert prepared == [0.3]
    assert ours.recv() == "ready"


@pytest.mark.usefixtures("without_rights")
def test_control_without_a_guard_ends_with_the_run():
    ours, its = Pipe()
    states, answers = Mailbox(state_dtype(1)), Mailbox(answer_dtype(1))
    with contextlib.closing(states), contextlib.closing(answers):
        ours.send("over")
        channels = Channels(1, states.name, answers.name, Inlet(1, "", "", ""))
        control_process(ControlJob(lambda: Posed([]), channels), its)
        assert not answers.count
