"""Loop in C in real processes: it lowers the arm whatever happens to control and to the parent of the guard."""

import contextlib
import errno
import itertools
import os
import signal
import socket
import struct
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from functools import partial
from itertools import chain
from multiprocessing.connection import Connection
from pathlib import Path
from typing import TypeVar

import numpy as np
import pytest
from tests.waiting import wait_until

from exograv.errors import RigError
from exograv.live.guard_job import GuardedRig, GuardJob, GuardReport
from exograv.live.guard_process import guard_process
from exograv.live.live_processes import LiveResult, ProcessParts, Running, fly
from exograv.live.native import library
from exograv.live.native_guard import ALONE, IN_C
from exograv.model.description import load_rig
from exograv.recording import read_recording
from exograv.recording.encoding import tick_dtype
from exograv.rig.drives.settings import Drives, load_drives
from exograv.rig.drives.udp.host import UdpRig
from exograv.rig.drives.udp.layout import DriveFlag, Flag, Type
from exograv.rig.drives.udp.packets import Header, Packet, decode, encode, name_bytes
from exograv.runtime.clock.realtime import GUARD_PRIORITY
from exograv.runtime.control_loop.answering import ControlJob, control_process
from exograv.runtime.control_loop.exchange import Channels, answer_dtype, state_dtype
from exograv.runtime.control_loop.guard_commands import (
    ENDS,
    PARENT_GONE,
    PARENT_SILENT,
    PARENT_SILENT_S,
    GuardLine,
)
from exograv.runtime.processes.shared_memory import Mailbox, Ring
from exograv.runtime.processes.supervisor import Supervisor
from exograv.runtime.recorder.recorder import Recorder
from exograv.runtime.recorder.recorder_process import EVENT, RING_EVENTS, RING_TICKS, Inlet
from exograv.safety.envelope import Envelope
from exograv.safety.guard import Guard
from exograv.safety.limits import Limits
from exograv.safety.native.library import LIBRARY
from exograv.safety.stops import StopReason

pytestmark = pytest.mark.skipif(library.LIBRARY is None or LIBRARY is None, reason="needs the compiled loop and guard")

EXAMPLE = Path(__file__).parents[2] / "examples" / "drives" / "udp.toml"
RIG = load_rig("recupera_like")
N, GAIN, TAU, PERIOD_NS = len(RIG.joints), 4.0, 2.0, 1_000_000
T = TypeVar("T")
PAUSE_S = 0.1
"""Pause of a process [s]."""
STARTS_S = 120.0
"""Time limit for two real-time processes to start on a loaded computer [s]."""
PERIODS = 60_000
"""More than any of these runs: each ends because of what happens in it."""
PAUSES = {StopReason.CONTROL_SILENT.value, StopReason.MACHINE_SILENT.value}
"""Causes of a stop where nothing but the computer is slow."""


class UnwornRig(UdpRig):
    """Machine that nobody wears: a stop of the guard does not end the run."""

    is_virtual = True


class Push:
    """Control that asks for a torque that shows on the drives."""

    mode_names = ("floating",)

    def answer(self, state: np.void, row: np.ndarray) -> None:
        row["mode"], row["slope"], row["tau"] = 0, 0.0, TAU
        row["v"], row["tau_feedforward"], row["q_reference"] = 0.0, 0.0, np.nan


class Spin(Push):
    """Control that enters an endless loop within its 500th answer."""

    def __init__(self):
        self._left = 500

    def answer(self, state: np.void, row: np.ndarray) -> None:
        super().answer(state, row)
        self._left -= 1
        while self._left <= 0:
            pass


class Halting(Push):
    """Control that pauses before its 500th answer, for longer than any guard of a machine in real time allows."""

    def __init__(self):
        self._left = 500

    def answer(self, state: np.void, row: np.ndarray) -> None:
        super().answer(state, row)
        self._left -= 1
        if self._left == 0:
            time.sleep(PAUSE_S)


def guarded(path: Path, is_worn: bool, waits: bool = False) -> GuardedRig:
    drives = load_drives(path, RIG)
    envelope = Envelope(Limits(np.full(N, 30.0), np.full(N, 10.0), descent_s=0.2), drives.period_s)
    guard = Guard.of_machine(envelope, drives.period_s, [GAIN] * N, is_known=False)
    return GuardedRig((UdpRig if is_worn else UnwornRig)(drives, lock_step=waits), guard, np.full(N, GAIN))


def standing_drives(opened: tuple[socket.socket, Path], parent: Connection) -> None:
    """Serve drives that stand still, until the parent hangs up. They have no watchdog that a pause could trip."""
    line, path = opened
    # Real drives have a computer of their own.
    with contextlib.suppress(OSError):
        os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(GUARD_PRIORITY + 10))
    drives, answering = load_drives(path, RIG), StandingDrives()
    line.settimeout(0.05)
    parent.send("ready")
    while not parent.poll():
        with contextlib.suppress(TimeoutError):
            data, sender = line.recvfrom(2048)
            if (answer := answering.receive(decode(data), drives)) is not None:
                line.sendto(answer, sender)


class StandingDrives:
    """Answers of drives that stand still."""

    def __init__(self):
        self._number = self._newest = 0
        self._is_on = False

    def receive(self, packet: Packet, drives: Drives) -> bytes | None:
        asked = packet.header
        self._number += 1
        header = Header(Type.STATE, N, 0, asked.session, 7, self._number, asked.sequence, time.monotonic_ns())
        if asked.kind is Type.HELLO:
            plates = [
                (name_bytes(one.joint), one.current_rated_A, one.current_max_A, one.brake_Nms_per_rad, 0)
                for one in drives.each
            ]
            own = round(1e6 * drives.watchdog_s), round(1e6 * drives.period_s)
            return encode(header._replace(kind=Type.NAMEPLATE), own, tuple(chain.from_iterable(plates)))
        if asked.kind is Type.POLL:
            status = DriveFlag.PRESENT | (DriveFlag.ENABLED if self._is_on else DriveFlag.NONE)
            return encode(header, (self._newest, 0), (0.1, 0.1, 0.5, 30.0, int(status), 0, 0, 0) * N)
        if asked.kind is Type.COMMAND:
            self._newest, self._is_on = asked.sequence, bool(asked.flags & Flag.ENABLE)
        return None


@dataclass
class Flight:
    """Guard, control and drives in processes of their own."""

    guard: Supervisor[GuardJob]
    control: Supervisor[ControlJob]
    drives: Supervisor[tuple[socket.socket, Path]]
    ticks: Ring
    events: Ring
    rows: list[np.ndarray] = field(default_factory=list)
    told: list[str] = field(default_factory=list)

    def carries(self) -> bool:
        """Return True if the drives get the torque that control asks for."""
        newest = self.ticks.newest()
        return newest is not None and newest[1]["tau_commanded"][0] == TAU

    def is_down(self) -> bool:
        """Return True if the drives get no torque any more."""
        newest = self.ticks.newest()
        return newest is not None and abs(newest[1]["tau_commanded"]).max() < 0.01 * TAU

    def report(self) -> GuardReport:
        return wait_until(lambda: self.guard.next_word(0.1), "the guard reports")

    def recorded(self) -> np.ndarray:
        self.rows.append(self.ticks.take())
        return np.concatenate(self.rows)

    def texts(self) -> list[str]:
        self.told += [row["text"].decode() for row in self.events.take()]
        return self.told

    def has_stopped(self) -> bool:
        return any(reason.value in self.texts() for reason in StopReason)


def drives_file(folder: Path, opened: socket.socket) -> Path:
    """Bind the socket, and return a settings file for drives behind it."""
    opened.bind(("127.0.0.1", 0))
    path = folder / "drives.toml"
    text = EXAMPLE.read_text(encoding="utf-8")
    path.write_text(text.replace("port = 47100", f"port = {opened.getsockname()[1]}"), encoding="utf-8")
    return path


@contextlib.contextmanager
def flying(
    folder: Path, is_worn: bool = True, control_of: Callable[[], Push] = Push, waits: bool = False
) -> Iterator[Flight]:
    with contextlib.ExitStack() as stack:
        opened = stack.enter_context(socket.socket(socket.AF_INET, socket.SOCK_DGRAM))
        path = drives_file(folder, opened)
        drives = Supervisor("drives", standing_drives, (opened, path))
        stack.callback(drives.end, 10.0, "over")
        rings = Ring(tick_dtype(N), RING_TICKS), Ring(EVENT, RING_EVENTS)
        made = Mailbox(state_dtype(N)), Mailbox(answer_dtype(N)), *rings
        states, answers, ticks, events = [stack.enter_context(contextlib.closing(one)).name for one in made]
        channels = Channels(N, states, answers, Inlet(N, ticks, events))
        job = GuardJob(partial(guarded, path, is_worn, waits), channels, PERIODS, Push.mode_names)
        drives.await_ready()
        guard = Supervisor("guard", guard_process, job)
        stack.callback(guard.end, 10.0)
        control = Supervisor("control", control_process, ControlJob(control_of, channels))
        stack.callback(control.end, 10.0)
        control.await_ready()
        guard.await_ready()
        guard.send("go")
        flight = Flight(guard, control, drives, *rings)
        wait_until(lambda: flight.carries() or flight.has_stopped(), "the drives get torque", STARTS_S)
        if flight.has_stopped():
            pytest.skip(f"The computer paused, and the guard stopped the machine: {flight.texts()}")
        yield flight


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


def test_drives_that_wait_for_the_loop_are_not_stopped_by_a_pause_of_control_or_drives(tmp_path: Path):
    with flying(tmp_path, control_of=Halting, waits=True) as flight:
        wait_until(lambda: flight.ticks.written > 800, "control has paused")
        os.kill(flight.drives.pid, signal.SIGSTOP)
        time.sleep(PAUSE_S)
        os.kill(flight.drives.pid, signal.SIGCONT)
        wait_until(lambda: flight.ticks.written > 1600, "the loop goes on")
        flight.guard.send(ENDS)
        report, rows = flight.report(), flight.recorded()
    assert [latch.cause for latch in report.latches] == [StopReason.STOP_PRESSED.value]
    assert IN_C not in report.rights.granted
    assert report.timing.waited_ns is not None
    assert 1e-9 * report.timing.waited_ns > 1.9 * PAUSE_S
    assert (np.diff(rows["sequence"].astype(int)) == 1).all()
    assert np.diff(rows["t"]) == pytest.approx(1e-9 * PERIOD_NS, abs=1e-9)


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
