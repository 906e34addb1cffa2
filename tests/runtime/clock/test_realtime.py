"""Real-time rights are returned in every way of leaving, and a refused right is reported with its remedy."""

import errno
import gc
import os
import resource
import subprocess
import sys
from collections.abc import Callable

import pytest

from exograv.runtime.clock import realtime as module
from exograv.runtime.clock.realtime import PRIORITY, realtime

SNAPSHOT = """
import gc, os, resource, signal
from pathlib import Path
from exograv.runtime.clock.realtime import realtime
def snapshot():
    status = Path("/proc/self/status").read_text()
    locked = next(line for line in status.splitlines() if line.startswith("VmLck"))
    scheduler = (os.sched_getscheduler(0), os.sched_getparam(0).sched_priority, os.sched_getaffinity(0))
    return scheduler, resource.getrlimit(resource.RLIMIT_RTTIME), gc.isenabled(), gc.get_freeze_count(), locked
cpu = max(os.sched_getaffinity(0))
before = snapshot()
"""

CPU = max(os.sched_getaffinity(0))

WAYS_OUT = {
    "in good order": "with realtime(cpu) as rights: pass",
    "by an error": "try:\n  with realtime(cpu) as rights: raise ValueError\nexcept ValueError: pass",
    "by the keyboard": (
        "try:\n  with realtime(cpu) as rights: os.kill(os.getpid(), signal.SIGINT)\nexcept KeyboardInterrupt: pass"
    ),
    "with the collector off before": "gc.disable(); before = snapshot()\nwith realtime(cpu) as rights: pass",
}


@pytest.mark.parametrize("way", WAYS_OUT)
def test_on_leaving_everything_is_as_before(way: str):
    program = f"{SNAPSHOT}{WAYS_OUT[way]}\nassert snapshot() == before, (before, snapshot())\n"
    result = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=False)
    assert result.returncode == 0, result.stderr


class System:
    """Mock of the system that records the calls, and refuses some of them."""

    def __init__(self, refused: tuple[str, ...] = ()):
        self.refused = refused
        self.asked: list[str] = []

    def call(self, name: str) -> Callable[..., None]:
        def act(*_arguments: object) -> None:
            self.asked.append(name)
            if name in self.refused:
                raise PermissionError(errno.EPERM, os.strerror(errno.EPERM))

        return act

    def put_under(self, patch: pytest.MonkeyPatch) -> None:
        """Redirect all calls beyond this interpreter to the mock."""
        for name in ("sched_setscheduler", "sched_setaffinity"):
            patch.setattr(os, name, self.call(name))
        patch.setattr(resource, "setrlimit", self.call("setrlimit"))
        patch.setattr(module, "_libc", self.call)


def test_the_scheduler_is_set_last_and_reset_first(monkeypatch: pytest.MonkeyPatch):
    system = System()
    system.put_under(monkeypatch)
    with realtime(CPU) as rights:
        assert system.asked[-1] == "sched_setscheduler"
        assert (rights.is_fifo, rights.is_locked, rights.refused) == (True, True, [])
        system.asked.clear()
    assert system.asked[0] == "sched_setscheduler"
    assert {"munlockall", "sched_setaffinity"} <= set(system.asked)


REFUSALS = {
    "sched_setscheduler": ("rtprio 99", "--cap-add=sys_nice"),
    "mlockall": ("memlock unlimited", "--ulimit memlock=-1"),
    "sched_setaffinity": ("Processor 3", "--cpuset-cpus=3"),
}


@pytest.mark.parametrize("name", REFUSALS)
def test_a_refusal_is_one_sentence_with_its_remedy_and_does_not_stop_the_rest(
    name: str, monkeypatch: pytest.MonkeyPatch
):
    system = System((name,))
    # The return of rights that were never granted may not be refused: affinity and scheduler are set to their old
    # values.
    leave = {"sched_setscheduler", "sched_setaffinity"}
    system.put_under(monkeypatch)
    with realtime(3) as rights:
        (sentence,) = rights.refused
        assert len(rights.granted) == 3
        system.refused = tuple(set(system.refused) - leave)
    assert all(words in sentence for words in REFUSALS[name])
    assert os.strerror(errno.EPERM) in sentence
    assert sentence.endswith(".")


def test_without_any_right_the_garbage_collector_is_off(monkeypatch: pytest.MonkeyPatch):
    system = System(tuple(REFUSALS))
    system.put_under(monkeypatch)
    with realtime(CPU) as rights:
        assert not gc.isenabled()
        assert rights.granted == ["garbage collector off"]
        assert len(rights.refused) == 3
        system.refused = ()
    assert gc.isenabled()


def test_the_processor_that_was_asked_for_is_taken(monkeypatch: pytest.MonkeyPatch):
    System().put_under(monkeypatch)
    with realtime(5) as rights:
        assert "processor 5" in rights.granted
        assert f"SCHED_FIFO {PRIORITY}" in rights.granted
