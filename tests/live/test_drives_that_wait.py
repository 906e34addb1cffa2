"""A pause of the computer does not stop drives that wait for the loop, and their end ends the run."""

import os
import signal
import time
from pathlib import Path

import numpy as np
import pytest
from tests.waiting import wait_until

from exograv.live.guard_job import GIVEN_UP_AFTER, WAITS_NS
from exograv.live.live_processes import HANGS_S
from exograv.live.native_guard import IN_C
from exograv.rig.drives.clock import ENDED
from exograv.runtime.control_loop.guard_commands import ENDS
from exograv.safety.native.library import LIBRARY
from exograv.safety.stops import StopReason

from .of_standing_drives import PAUSE_S, PERIOD_NS, STARTS_S, Halting, flying

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


@pytest.mark.parametrize("number", [signal.SIGKILL, pytest.param(signal.SIGSTOP, marks=pytest.mark.long)])
def test_drives_that_wait_and_do_not_answer_any_more_end_the_run_with_their_reason(
    tmp_path: Path, number: signal.Signals, capfd: pytest.CaptureFixture[str]
):
    with flying(tmp_path, waits=True) as flight:
        os.kill(flight.drives.pid, number)
        begun = time.monotonic()
        report = flight.report()
        waited_s = time.monotonic() - begun
        os.kill(flight.drives.pid, signal.SIGKILL)
        assert flight.guard.await_exit(STARTS_S) == 0
        assert ENDED in flight.texts()
    assert report.failure == ENDED
    assert waited_s < HANGS_S, "the parent would kill the guard"
    assert "Traceback" not in capfd.readouterr().err


@pytest.mark.long
def test_a_guard_whose_drives_wait_lowers_the_arm_in_time_without_any_control(tmp_path: Path):
    with flying(tmp_path, waits=True) as flight:
        os.kill(flight.control.pid, signal.SIGKILL)
        begun = time.monotonic()
        report = flight.report()
        took_s, rows = time.monotonic() - begun, flight.recorded()
    assert [latch.cause for latch in report.latches] == [StopReason.CONTROL_SILENT.value]
    lowered = int((rows["safe_state"] > 1).sum())
    assert took_s < 1e-9 * (GIVEN_UP_AFTER + 2) * WAITS_NS + 10.0 * lowered * 1e-9 * PERIOD_NS
