"""Loop in C in real processes: it lowers the arm whatever happens to control and to the parent of the guard."""

import contextlib
import errno
import itertools
import os
import signal
import socket
import struct
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TypeVar

import numpy as np
import pytest
from tests.waiting import wait_until

from exograv.errors import RigError
from exograv.live.guard_job import GuardReport
from exograv.live.live_processes import LiveResult, ProcessParts, Running, fly
from exograv.live.native import library
from exograv.live.native_guard import ALONE, IN_C
from exograv.recording import read_recording
from exograv.runtime.control_loop.guard_commands import (
    ENDS,
    PARENT_GONE,
    PARENT_SILENT,
    PARENT_SILENT_S,
    GuardLine,
)
from exograv.runtime.processes.supervisor import Supervisor
from exograv.runtime.recorder.recorder import Recorder
from exograv.safety.native.library import LIBRARY
from exograv.safety.stops import StopReason

from .of_standing_drives import (
    RIG,
    TAU,
    Push,
    Spin,
    drives_file,
    flying,
    guarded,
    standing_drives,
)

pytestmark = pytest.mark.skipif(library.LIBRARY is None or LIBRARY is None, reason="needs the compiled loop and guard")

T = TypeVar("T")

PAUSES = {StopReason.CONTROL_SILENT.value, StopReason.MACHINE_SILENT.value}
"""Causes of a stop where nothing but the computer is slow."""


def flown_without_a_pause(folder: Path, flight: Callable[[Path], tuple[GuardReport, T]]) -> tuple[GuardReport, T]:
    """Return what this flight returns; fly it again, twice at most, if a silent machine has stopped it.

    The computer may pause before that happens which the flight is about. What itself silences the machine does so each
    time, and the test sees it.
    """
    for attempt in ("first", "second"):
        (folder / attempt).mkdir()
        report, seen = flight(folder / attempt)
        if report.latches[0].cause != StopReason.MACHINE_SILENT.value:
            return report, seen
    (folder / "third").mkdir()
    return flight(folder / "third")


def test_stop_lowers_the_arm_and_each_tick_is_recorded_and_sent_once(tmp_path: Path):
    with flying(tmp_path) as flight:
        flight.guard.send(ENDS)
        report = flight.report()
        rows = flight.recorded()
    assert IN_C in report.rights.granted
    assert len(report.latches) == 1
    assert len(rows) == len(report.timing.period) > 200
    assert (np.diff(rows["sequence"].astype(int)) >= 0).all()
    assert (np.diff(report.timing.period) >= 1).all()
    assert np.abs(rows["tau_commanded"][-1]).max() < 1e-6
    assert [name for name, _ in report.modes] == ["floating"]


def test_a_killed_control_costs_a_descent(tmp_path: Path):
    def kill(folder: Path) -> tuple[GuardReport, np.ndarray]:
        with flying(folder) as flight:
            flight.control.kill()
            return flight.report(), flight.recorded()

    report, rows = flown_without_a_pause(tmp_path, kill)
    assert [latch.cause for latch in report.latches] == ["Control did not answer in time."]
    assert np.abs(rows["tau_commanded"][-1]).max() < 1e-6
    assert (rows["safe_state"] > 0).any()


def test_a_control_in_an_endless_loop_delays_no_tick_and_is_ended(tmp_path: Path):
    def spin(folder: Path) -> tuple[GuardReport, tuple[np.ndarray, int | None]]:
        with flying(folder, control_of=Spin) as flight:
            report, rows, status = flight.report(), flight.recorded(), None
            if report.rights.is_fifo:  # without this right the kernel does not end control
                status = wait_until(lambda: flight.control.exit_status, "the kernel ends control")
            return report, (rows, status)

    report, (rows, ended) = flown_without_a_pause(tmp_path, spin)
    assert [latch.cause for latch in report.latches] == ["Control did not answer in time."]
    assert np.abs(rows["tau_commanded"][-1]).max() < 1e-6
    if report.rights.is_fifo:
        assert ended == -signal.SIGXCPU
        assert np.diff(rows["monotonic"][-250:]).max() < 0.010


@pytest.mark.slow
def test_a_control_that_stands_still_costs_a_descent(tmp_path: Path):
    def halt(folder: Path) -> tuple[GuardReport, None]:
        with flying(folder) as flight:
            os.kill(flight.control.pid, signal.SIGSTOP)
            report = flight.report()
            os.kill(flight.control.pid, signal.SIGCONT)
            return report, None

    report, _ = flown_without_a_pause(tmp_path, halt)
    assert [latch.cause for latch in report.latches] == ["Control did not answer in time."]


def test_half_a_word_of_the_parent_lowers_the_arm_at_once_and_costs_no_tick(tmp_path: Path):
    def half_a_word(folder: Path) -> tuple[GuardReport, tuple[np.ndarray, list[str]]]:
        with flying(folder) as flight:
            before = flight.ticks.written
            os.write(flight.guard._line._connection.fileno(), struct.pack("!i", 1000))
            report = flight.report()
            return report, (flight.recorded()[before:], flight.texts())

    report, (rows, texts) = flown_without_a_pause(tmp_path, half_a_word)
    assert PARENT_GONE in texts
    assert [latch.cause for latch in report.latches] == [StopReason.STOP_PRESSED.value]
    assert np.abs(rows["tau_commanded"][-1]).max() < 0.01 * TAU
    assert np.count_nonzero(rows["tau_commanded"][:, 0] > 0.9 * TAU) < 200
    assert np.median(np.diff(rows["monotonic"])) < 2e-3


@pytest.mark.slow
def test_a_parent_that_is_gone_ends_the_run_with_the_arm_down(tmp_path: Path):
    with flying(tmp_path) as flight:
        flight.guard._line.close()
        wait_until(flight.is_down, "the arm is down")
        assert wait_until(lambda: flight.guard.exit_status is not None, "the guard has ended")
        assert flight.guard.exit_status == 0
        assert ALONE not in flight.texts()


@pytest.mark.slow
def test_without_a_wearer_the_loop_goes_on_after_a_stop_and_asks_control_again(tmp_path: Path):
    with flying(tmp_path, is_worn=False) as flight:
        os.kill(flight.control.pid, signal.SIGSTOP)
        wait_until(flight.is_down, "the arm is down")
        os.kill(flight.control.pid, signal.SIGCONT)
        written = flight.ticks.written
        wait_until(lambda: flight.ticks.written > written + 100, "the loop goes on")
        wait_until(lambda: bool(flight.recorded()[-50:]["seen"].any()), "control answers again")
        flight.guard.send(ENDS)
        assert len(flight.report().latches) == 1


@dataclass
class Session:
    """Session over guard, control and recorder, as a command runs it."""

    path: Path
    drives: Path

    def run(
        self,
        progress: Callable[[str, float], None],
        seconds: float = 20.0,
        started: Callable[[Running], object] = lambda _: None,
    ) -> LiveResult:
        parts = ProcessParts(partial(guarded, self.drives, True), Push, Push, Push.mode_names)
        with Recorder(self.path, RIG.joints, {"rig": RIG.name}, seconds) as recorder:
            result = fly(parts, seconds, recorder, progress, started)
        if any(latch.cause in PAUSES for latch in result.report.latches):
            pytest.skip("The computer paused, and the guard stopped the machine.")
        return result

    def commanded(self) -> np.ndarray:
        """Return the recorded torque of the first joint (tick,) [N·m]; the arm was carried, and came down softly."""
        tau = read_recording(self.path).ticks["tau_commanded"][:, 0]
        if (tau == TAU).sum() < 100:
            pytest.skip("The computer paused, and the guard stopped the machine before it carried.")
        return tau


@pytest.fixture
def session(tmp_path: Path) -> Iterator[Session]:
    with contextlib.ExitStack() as stack:
        opened = stack.enter_context(socket.socket(socket.AF_INET, socket.SOCK_DGRAM))
        path = drives_file(tmp_path, opened)
        drives = Supervisor("drives", standing_drives, (opened, path))
        stack.callback(drives.end, 10.0, "over")
        drives.await_ready()
        yield Session(tmp_path / "live.mcap", path)


def test_an_error_of_the_session_lowers_the_arm_before_any_process_is_ended(session: Session):
    def fail(phase: str, share: float) -> None:
        if phase == "Floating live" and share > 0.05:
            raise OSError(errno.EMFILE, "Too many open files")

    with pytest.raises(OSError, match="Too many open files"):
        session.run(fail)
    tau = session.commanded()
    falls = np.flatnonzero(np.diff(tau) < 0.0)
    assert abs(tau[-1]) < 0.02 * TAU
    assert len(falls) > 100, "a descent of 0.2 s takes 200 ticks"


def test_a_session_that_gives_no_sign_of_life_loses_the_arm_softly(session: Session, monkeypatch: pytest.MonkeyPatch):
    beat, beats = GuardLine.beat, itertools.count()
    # As if Ctrl-Z had stopped it after its first sign of life.
    monkeypatch.setattr(GuardLine, "beat", lambda line: None if next(beats) else beat(line))
    result = session.run(lambda *_: None)
    assert [latch.cause for latch in result.report.latches] == [StopReason.STOP_PRESSED.value]
    assert result.report.latches[0].at_s == pytest.approx(PARENT_SILENT_S, abs=1.0)
    assert abs(session.commanded()[-1]) < 0.02 * TAU
    assert PARENT_SILENT in [event["text"] for event in read_recording(session.path).messages("/event")]


def test_a_guard_that_hangs_is_ended_and_the_recording_is_kept(session: Session, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr("exograv.live.live_processes.HANGS_S", 1.0)
    guards = list[int]()
    started = lambda running: guards.append(running.guard.pid)  # noqa: E731 - a function would be longer

    def stop(phase: str, share: float) -> None:
        if phase == "Floating live" and share > 0.05:
            os.kill(guards[0], signal.SIGSTOP)

    with pytest.raises(RigError, match=r"guard process died .* brake the arm"):
        session.run(stop, started=started)
    assert session.commanded()[-1] == TAU
