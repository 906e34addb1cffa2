"""The parent ends a guard whose loop stands still, and no guard whose ticks only find no room in the recording."""

import contextlib
import os
import struct
from collections.abc import Callable
from dataclasses import dataclass
from multiprocessing.connection import Connection
from typing import cast
from unittest.mock import Mock

import pytest

from exograv.errors import RigError
from exograv.live.guard_job import GuardJob, GuardReport
from exograv.live.live_processes import ENABLES_S, HANGS_S, GuardWatch, _watched
from exograv.runtime.control_loop.guard_commands import GuardLine
from exograv.runtime.processes.supervisor import Supervisor


@dataclass
class Clock:
    now: float = 0.0

    def monotonic(self) -> float:
        return self.now


@dataclass
class Loop:
    """Mock of the guard's loop."""

    offered: int = 0
    killed: int = 0

    def kill(self) -> None:
        self.killed += 1


@pytest.fixture
def clock(monkeypatch: pytest.MonkeyPatch) -> Clock:
    clock = Clock()
    monkeypatch.setattr("exograv.live.live_processes.time", clock)
    return clock


def watch_of(loop: Loop, clock: Clock) -> GuardWatch:
    return GuardWatch(loop.kill, lambda: loop.offered, 0, clock.now)


def test_a_loop_that_ticks_is_not_ended(clock: Clock):
    loop = Loop()
    watch = watch_of(loop, clock)
    for _ in range(200):
        loop.offered, clock.now = loop.offered + 1, clock.now + 1.0
        watch.check()
    assert loop.killed == 0


@pytest.mark.parametrize(("offered", "limit_s"), [(0, ENABLES_S), (5, HANGS_S)])
def test_a_loop_that_stands_still_is_ended_after_its_limit(clock: Clock, offered: int, limit_s: float):
    loop = Loop(offered)
    watch = watch_of(loop, clock)
    watch.check()
    clock.now = 0.9 * limit_s
    watch.check()
    assert loop.killed == 0
    clock.now = 1.1 * limit_s
    watch.check()
    assert loop.killed == 1


@dataclass
class Guard:
    """Mock of the guard's process, which reports after some words of silence."""

    clock: Clock
    silences: int

    def next_word(self, _seconds: float) -> GuardReport | None:
        self.clock.now += 5.0
        self.silences -= 1
        return cast(GuardReport, object.__new__(GuardReport)) if self.silences < 0 else None


def test_the_progress_of_a_loop_is_its_share_of_ticks_and_not_of_seconds(clock: Clock):
    loop, shown = Loop(), list[float]()

    def show(_phase: str, share: float) -> None:
        shown.append(share)
        loop.offered += 100

    said = Guard(clock, 4)
    guard = Mock(spec=Supervisor, next_word=said.next_word, has_hung_up=False)
    line = Mock(spec=GuardLine, replies=list)
    _watched(guard, line, (), show, lambda: loop.offered / 400, lambda _: None)
    assert shown == [0.0, 0.25, 0.5, 0.75]


def ends_well(line: Connection) -> None:
    line.send("a report")


def goes_on(line: Connection) -> None:
    line.send("a report")
    with contextlib.suppress(EOFError):
        line.recv()


def dies(_: Connection) -> None:
    os._exit(3)


def half_word_first(rest: Callable[[Connection], None], line: Connection) -> None:
    os.write(line.fileno(), struct.pack("!i", 8) + b"half")
    rest(line)


@pytest.mark.parametrize(
    ("rest", "words"),
    [(ends_well, "report .* cannot be read"), (goes_on, "lowers the arm"), (dies, r"died \(exit status 3\).*brake")],
)
def test_a_guard_without_a_readable_report_is_told_as_dead_only_if_it_died(
    rest: Callable[[Connection], None], words: str
):
    line, guard = GuardLine(), Supervisor("guard", half_word_first, rest)
    with contextlib.closing(line), pytest.raises(RigError, match=words):
        _watched(cast(Supervisor[GuardJob], guard), line, (), lambda *_: None, lambda: 0.0, print)
    guard.end(1.0)
