"""A child process is heard, replaced within a limit, and ended; the parent never waits longer than stated."""

import contextlib
import os
import time
from collections.abc import Iterator
from multiprocessing.connection import Connection

import pytest

from exograv.errors import RigError
from exograv.runtime.processes.supervisor import Supervisor

SOON_S = 30.0


def says(word: str, parent: Connection) -> None:
    """Send the message of the job, then follow the parent's messages."""
    parent.send(word)
    with contextlib.suppress(EOFError):
        while parent.recv() != "over":
            pass


def dies(_job: object, _parent: Connection) -> None:
    raise SystemExit(3)


def hangs(_job: object, parent: Connection) -> None:
    parent.send("ready")
    time.sleep(600.0)


@contextlib.contextmanager
def supervised(target, job: object, fruitless_max: int = 0) -> Iterator[Supervisor[object]]:
    child = Supervisor("child", target, job, fruitless_max)
    try:
        yield child
    finally:
        child.end(0.0)


def test_each_process_gets_its_own_job_and_is_counted():
    with supervised(says, "first", 1) as child:
        assert child.next_word(SOON_S) == "first"
        pid = child.pid
        assert child.replace("second")
        assert child.next_word(SOON_S) == "second"
        assert child.pid != pid
        assert child.restarts == 1


def test_fruitless_processes_are_replaced_only_up_to_the_limit():
    with supervised(says, "a", 1) as child:
        assert child.replace("b")
        assert not child.replace("c")
        assert child.is_alive  # a process that is not replaced keeps running
        child.succeeded()
        assert child.replace("d")
        assert child.replace("e", was_fruitless=False)
        assert child.restarts == 3


def test_a_replacement_that_was_of_use_begins_the_count_of_fruitless_ones_again():
    with supervised(says, "a", 2) as child:
        assert child.replace("b")
        assert child.replace("c", was_fruitless=False)
        assert child.replace("d")
        assert child.replace("e")
        assert not child.replace("f")


def test_replaced_processes_leave_no_descriptor_open():
    counts = []
    for jobs in ((), ("second", "third", "fourth")):
        with supervised(says, "first", 3) as child:
            child.await_ready()
            for job in jobs:
                assert child.replace(job)
                assert child.next_word(SOON_S) == job
        counts.append(len(os.listdir("/proc/self/fd")))
    assert counts[1] == counts[0]


def test_a_process_that_dies_before_it_is_ready_is_an_error_with_its_exit_status():
    with supervised(dies, None) as child, pytest.raises(RigError, match=r"'child' was not ready \(exit status 3\)"):
        child.await_ready()


def test_a_dead_process_hangs_up_and_gets_no_messages():
    with supervised(says, "ready") as child:
        child.await_ready()
        assert not child.has_hung_up
        child.kill()
        assert child.await_exit(SOON_S) == -9
        assert list(child.heard()) == []
        assert child.has_hung_up
        child.send("over")


@pytest.mark.parametrize("word", ["over", None])
def test_a_process_ends_by_itself_after_the_end_message_or_when_its_line_is_closed(word: object):
    with supervised(says, "ready") as child:
        child.await_ready()
        child.end(SOON_S, word)
        assert child.exit_status == 0


def test_a_process_that_does_not_end_is_killed():
    with supervised(hangs, None) as child:
        child.await_ready()
        child.end(0.1, "over")
        assert child.exit_status == -9
