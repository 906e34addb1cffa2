"""Simulated drives that wait for the loop are not stopped by a pause of the computer."""

import os
import signal
import time
from pathlib import Path

import numpy as np
import pytest
from tests.waiting import wait_until

from exograv.live.native_guard import IN_C
from exograv.runtime.control_loop.guard_commands import ENDS
from exograv.safety.native.library import LIBRARY
from exograv.safety.stops import StopReason

from .of_standing_drives import PAUSE_S, PERIOD_NS, Halting, flying

pytestmark = pytest.mark.skipif(LIBRARY is None, reason="needs the compiled guard")


def test_drives_that_wait_for_the_loop_are_not_stopped_by_a_pause_of_control_or_drives(tmp_path: Path):
    with flying(tmp_path, control_of=Halting, waits=True) as flight:
        wait_until(lambda: flight.ticks.written > 800, "control has paused")
        os.kill(flight.drives.pid, signal.SIGSTOP)
        time.sleep(PAUSE_S)
        os.kill(flight.drives.pid, signal.SIGCONT)
        wait_until(lambda: flight.ticks.written > 1600, "the loop goes on")
        flight.guard.send(ENDS)
        report, rows = flight.report(), flight.recorded()
    assert IN_C not in report.rights.granted
    assert report.timing.waited_ns is not None
    assert 1e-9 * report.timing.waited_ns > 1.9 * PAUSE_S
    (latch,) = report.latches
    assert latch.cause == StopReason.STOP_PRESSED.value
    assert latch.at_s == pytest.approx(1e-9 * PERIOD_NS * latch.period, abs=1e-9)  # not longer by the pauses
    assert (np.diff(rows["sequence"].astype(int)) == 1).all()
    assert np.diff(rows["t"]) == pytest.approx(1e-9 * PERIOD_NS, abs=1e-9)
