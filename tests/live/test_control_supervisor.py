"""A control that dies or hangs is replaced by one that carries nothing; a control without requests is kept."""

import contextlib
import os
import signal
from collections.abc import Iterator
from multiprocessing.connection import Connection

import numpy as np
import pytest
from tests.waiting import wait_until

from exograv.live.control_supervisor import FRUITLESS_MAX, HANGS_TICKS, ControlKeeper
from exograv.runtime.control_loop.answering import ControlJob
from exograv.runtime.control_loop.exchange import Channels, answer_dtype, state_dtype
from exograv.runtime.processes.shared_memory import Mailbox
from exograv.runtime.recorder.recorder_process import Inlet

FIRST, LATER = 1, 2
SOON_S = 30.0  # For a slow computer. No test waits so long.


class Answers:
    """Mock of a control with an identity."""


def first() -> Answers:
    return Answers()


def later() -> Answers:
    return Answers()


def dies() -> Answers:
    raise SystemExit(1)


def answer_at_once(job: ControlJob, parent: Connection) -> None:
    """Mock of the control process: it answers every request with its identity, and ends when its parent has ended."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    job.build()
    states = Mailbox(state_dtype(1), job.channels.states)
    answers = Mailbox(answer_dtype(1), job.channels.answers)
    row, seen = np.zeros((), answer_dtype(1)), 0
    row["mode"] = FIRST if job.build is first else LATER
    parent.send("ready")
    with contextlib.suppress(EOFError):
        while not parent.poll(0.002):
            got = states.read()
            if got is not None and got[0] != seen:
                seen = got[0]
                answers.write(row)
    states.close()
    answers.close()


class Desk:
    """Parent's side of control, with the mailboxes of the guard."""

    def __init__(self, again=later):
        self.states, self.answers = Mailbox(state_dtype(1)), Mailbox(answer_dtype(1))
        channels = Channels(1, self.states.name, self.answers.name, Inlet(1, "", "", ""))
        self.keeper = ControlKeeper(first, again, channels, self.states, self.answers)  # pyright: ignore[reportArgumentType]

    def ask(self, times: int = 1) -> None:
        for _ in range(times):
            self.states.write(np.zeros((), state_dtype(1)))

    def until_answered_by(self, who: int) -> None:
        def is_answered() -> bool:
            self.ask()
            self.keeper.check()
            got = self.answers.read()
            return got is not None and got[1]["mode"] == who

        wait_until(is_answered, f"an answer of control {who}", SOON_S)


@pytest.fixture
def make_desk(monkeypatch: pytest.MonkeyPatch) -> Iterator:
    monkeypatch.setattr("exograv.live.control_supervisor.control_process", answer_at_once)
    desks: list[Desk] = []

    def make(again=later) -> Desk:
        desks.append(Desk(again))
        desks[-1].keeper.await_ready()
        return desks[-1]

    yield make
    for desk in desks:
        desk.keeper.close()
        desk.states.close()
        desk.answers.close()


def test_a_control_that_was_killed_is_followed_by_one_that_carries_nothing(make_desk):
    desk = make_desk()
    desk.until_answered_by(FIRST)
    os.kill(desk.keeper.pid, signal.SIGKILL)
    desk.until_answered_by(LATER)
    assert desk.keeper.restarts == 1


def test_a_control_that_hangs_is_replaced_only_when_it_was_asked_for_long(make_desk):
    desk = make_desk()
    desk.until_answered_by(FIRST)
    pid = desk.keeper.pid
    os.kill(pid, signal.SIGSTOP)
    desk.keeper.check()
    desk.ask(HANGS_TICKS // 2)
    desk.keeper.check()
    assert desk.keeper.pid == pid
    desk.ask(HANGS_TICKS)
    desk.keeper.check()
    assert desk.keeper.pid != pid
    desk.until_answered_by(LATER)


@pytest.mark.slow
def test_controls_that_die_at_once_are_given_up(make_desk):
    desk = make_desk(dies)
    os.kill(desk.keeper.pid, signal.SIGKILL)

    def is_given_up() -> bool:
        desk.keeper.check()
        return desk.keeper.restarts >= FRUITLESS_MAX

    wait_until(is_given_up, "the last restart", SOON_S)
    desk.keeper._child.await_exit(SOON_S)
    desk.keeper.check()
    assert desk.keeper.restarts == FRUITLESS_MAX
