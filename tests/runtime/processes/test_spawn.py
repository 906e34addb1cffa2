"""Ctrl-C, SIGHUP and SIGTERM can reach all processes at once; spawned processes leave them to their parent."""

import os
import signal
import subprocess
import sys
from collections.abc import Callable
from multiprocessing.connection import Connection
from pathlib import Path

import pytest
from tests.waiting import wait_until

from exograv.errors import RigError
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


def says_its_session(_job: object, parent: Connection) -> None:
    parent.send((os.getpid(), os.getsid(0), os.getpgid(0)))
    parent.recv()


@pytest.mark.skipif(os.name != "posix", reason="Windows has no sessions")
def test_a_process_has_a_session_of_its_own_so_that_no_key_of_a_terminal_stops_it():
    process, line = spawned("child", says_its_session, None)
    pid, session, group = line.recv()
    assert session == group == pid != os.getsid(0)
    line.send("over")
    process.join(SOON_S)


def refuses(word: str, _parent: Connection) -> None:
    raise RigError(word)


def errs(word: str, _parent: Connection) -> None:
    raise ValueError(word)


@pytest.mark.parametrize(("target", "has_traceback"), [(refuses, False), (errs, True)])
def test_only_an_unforeseen_error_ends_a_process_with_a_traceback(
    target: Callable[[str, Connection], None], has_traceback: bool, capfd: pytest.CaptureFixture[str]
):
    process, _line = spawned("child", target, "The elbow has gone.")
    process.join(SOON_S)
    said = capfd.readouterr().err
    assert process.exitcode == 1
    assert "The elbow has gone." in said
    assert ("Traceback" in said) is has_traceback


DELETES = """
import os, signal
from exograv.runtime.processes.shared_memory import Mailbox
import numpy as np
made = Mailbox(np.dtype("<u8"))
print(made.name, flush=True)
signal.signal(signal.SIGHUP, signal.SIG_DFL)  # under nohup a process inherits that it ignores the signal
os.killpg(0, signal.SIGHUP)
"""


@pytest.mark.skipif(not Path("/dev/shm").is_dir(), reason="needs shared memory that is shown as files")
def test_a_closed_terminal_that_kills_a_process_leaves_no_shared_memory():
    child = subprocess.run(
        [sys.executable, "-c", DELETES], start_new_session=True, capture_output=True, text=True, check=False
    )
    assert child.returncode == -signal.SIGHUP
    name = child.stdout.strip().lstrip("/")
    assert name
    wait_until(lambda: not (Path("/dev/shm") / name).exists(), "the memory is deleted", SOON_S)


SCRIPT = """
from tests.runtime.processes.test_spawn import says
from exograv.runtime.processes.spawn import spawned

print("begun", flush=True)
process, line = spawned("child", says, "here")
print(line.recv(), __file__, flush=True)
process.join()
"""


def test_a_script_without_a_main_guard_does_not_begin_again_in_its_processes(tmp_path: Path):
    path = tmp_path / "script.py"
    path.write_text(SCRIPT)
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)}
    run = subprocess.run(
        [sys.executable, str(path)], check=False, env=environment, capture_output=True, text=True, timeout=SOON_S
    )
    assert run.stdout.splitlines() == ["begun", f"here {path}"], run.stderr
