"""Ctrl-C reaches all processes of a terminal at once; spawned processes leave it to their parent."""

import os
import signal
from multiprocessing.connection import Connection

from tests.waiting import wait_until

from exograv.runtime.processes.spawn import spawned

SOON_S = 30.0


def says(word: str, parent: Connection) -> None:
    parent.send(word)


def test_a_process_that_just_starts_survives_ctrl_c_and_sends_its_message():
    process, line = spawned("child", says, "here")

    def has_said() -> bool:
        os.kill(process.pid or 0, signal.SIGINT)
        return line.poll()

    wait_until(has_said, "the child's word", SOON_S)
    assert line.recv() == "here"
    process.join(SOON_S)
    assert process.exitcode == 0


def test_the_parent_hears_ctrl_c_as_before():
    before = signal.getsignal(signal.SIGINT)
    process, _line = spawned("child", says, "here")
    assert signal.getsignal(signal.SIGINT) is before
    process.kill()
    process.join(SOON_S)
