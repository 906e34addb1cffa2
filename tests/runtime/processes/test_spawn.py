"""Ctrl-C reaches all processes of a terminal at once; those that were spawned leave it to their parent."""

import os
import signal
import time
from multiprocessing.connection import Connection

from exograv.runtime.processes.spawn import spawned

SOON_S = 30.0


def says(word: str, parent: Connection) -> None:
    time.sleep(0.2)
    parent.send(word)


def test_a_process_that_just_begins_survives_ctrl_c_and_says_its_word():
    process, line = spawned("child", says, "here")
    for _ in range(20):
        os.kill(process.pid or 0, signal.SIGINT)
        time.sleep(0.01)
    assert line.poll(SOON_S)
    assert line.recv() == "here"
    process.join(SOON_S)
    assert process.exitcode == 0


def test_the_parent_hears_ctrl_c_as_before():
    before = signal.getsignal(signal.SIGINT)
    process, _line = spawned("child", says, "here")
    assert signal.getsignal(signal.SIGINT) is before
    process.kill()
    process.join(SOON_S)
