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
    def rights() -> Iterator[None]:
        said_before.append(ours.poll())
        yield
        said_before.append(ours.poll())

    monkeypatch.setattr("exograv.runtime.control_loop.answering.realtime", rights)
    states, answers = Mailbox(state_dtype(1)), Mailbox(answer_dtype(1))
    with contextlib.closing(states), contextlib.closing(answers):
        channels = Channels(1, states.name, answers.name, Inlet(1, "", ""))
        control_process(ControlJob(Silent, channels), its)
    assert said_before == [False, True]
    assert ours.recv() == "ready"
