"""Ctrl-C, SIGHUP and SIGTERM can reach all processes at once; spawned processes leave them to their parent."""

import os
import signal
from multiprocessing.connection import Connection

import pytest
from tests.waiting import wait_until

from exograv.runtime.processes.spawn import END_SIGNALS, spawned

SOON_S = 30.0


def says(word: str, parent: Connection) -> None:
    parent.send(word)


@pytest.mark.skipif(os.name != "posix", reason="Windows ends a process by any of these signals")
@pytest.mark.parametrize("strike", END_SIGNALS)
def test_a_process_that_just_starts_survives_these_signals_and_sends_its_message(strike: signal.Signals):
    process, line = spawned("child", says, "here")

    def has_said() -> bool:
        os.kill(process.pid or 0, strike)
        return line.poll()

    wait_until(has_said, "the child's word", SOON_S)
    assert line.recv() == "here"
    process.join(SOON_S)
    assert process.exitcode == 0


def test_the_parent_hears_these_signals_as_before():
    before = [signal.getsignal(number) for number in END_SIGNALS]
    process, _line = spawned("child", says, "here")
    assert [signal.getsignal(number) for number in END_SIGNALS] == before
    process.kill()
    process.join(SOON_S)
