"""Drivers and drives in real time: cables, killed hosts, and the time that a loop needs."""

import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import pytest

from exograv.rig.drives.settings import Drives

from .driving import CURRENT, LATE_MS, brakes, drive, watchdogs

LOCK_STEP = False

pytestmark = pytest.mark.slow  # a busy computer may stall for longer than a watchdog's time-out


def test_measurements_count_up_and_never_go_back(rig: Any):
    first = state = before = rig.read()
    due = time.monotonic()
    for _ in range(300):
        due += rig.period_s
        time.sleep(max(due - time.monotonic(), 0.0))
        state = rig.read()
        assert state.sequence >= before.sequence
        assert state.t >= before.t
        before = state
    assert state.sequence > first.sequence  # benchmarks/udp_loop.py counts the losses on a busy computer


def test_when_the_cable_is_out_all_are_faulty_nothing_is_invented_and_it_takes_an_enable(
    rig: Any, bench: Any, drives: Drives
):
    rig.enable()
    drive(rig, 0.05, CURRENT)
    bench.do("cut")
    state = drive(rig, 0.1, CURRENT)
    assert state.faulty == (0, 1, 2, 3)
    later = drive(rig, 0.1, CURRENT)
    assert (later.sequence, later.t) == (state.sequence, state.t)
    assert max(watchdogs(bench, drives).values()) <= drives.settings.watchdog_ms + LATE_MS
    bench.do("mend")
    state = drive(rig, 0.2, CURRENT)
    assert state.sequence > later.sequence
    assert brakes(bench, drives)
    rig.enable()
    assert all(one.is_enabled for one in rig.status())


HOST = """
import sys, time
sys.path.insert(0, {folder!r})
from pathlib import Path
from driving import drive
from exograv.model.description import load_rig
from exograv.rig.drives.settings import load_drives
{imports}
with make(load_drives(Path({path!r}), load_rig("recupera_like"))) as rig:
    rig.enable()
    print("on", flush=True)
    drive(rig, 60.0, {current})
"""


@pytest.mark.parametrize("how", [signal.SIGKILL, signal.SIGINT])
def test_a_killed_host_leaves_drives_that_brake_and_a_machine_for_the_next(
    how: signal.Signals, served: Any, bench: Any, drives: Drives, make_rig: Any
):
    imports = f"from {make_rig.__module__} import {make_rig.__qualname__} as make"
    program = HOST.format(folder=str(Path(__file__).parent), path=str(served[1]), current=CURRENT, imports=imports)
    with subprocess.Popen([sys.executable, "-c", program], stdout=subprocess.PIPE, stderr=subprocess.DEVNULL) as host:
        assert host.stdout is not None
        assert host.stdout.readline() == b"on\n"
        time.sleep(0.2)
        host.send_signal(how)
        host.wait()
    assert any(brakes(bench, drives) for _ in range(200))  # one report in each of the device's steps
    if how is signal.SIGKILL:
        assert max(watchdogs(bench, drives).values()) <= drives.settings.watchdog_ms + LATE_MS
    with make_rig(drives) as rig:
        rig.enable()
