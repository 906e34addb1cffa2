"""Guard, control and drives that stand still, each in a process of its own."""

import contextlib
import os
import socket
import time
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from functools import partial
from itertools import chain
from multiprocessing.connection import Connection
from pathlib import Path

import numpy as np
import pytest
from tests.waiting import wait_until

from exograv.live.guard_job import GuardedRig, GuardJob, GuardReport
from exograv.live.guard_process import guard_process
from exograv.model.description import load_rig
from exograv.recording.encoding import tick_dtype
from exograv.rig.drives.settings import Drives, load_drives
from exograv.rig.drives.udp.host import UdpRig
from exograv.rig.drives.udp.layout import DriveFlag, Flag, Type
from exograv.rig.drives.udp.packets import Header, Packet, decode, encode, name_bytes
from exograv.runtime.clock.realtime import GUARD_PRIORITY
from exograv.runtime.control_loop.answering import ControlJob, control_process
from exograv.runtime.control_loop.exchange import Channels, answer_dtype, state_dtype
from exograv.runtime.processes.shared_memory import Mailbox, Ring
from exograv.runtime.processes.supervisor import Supervisor
from exograv.runtime.recorder.recorder_process import (
    EVENT,
    RING_EVENTS,
    RING_GUARDS,
    RING_TICKS,
    Inlet,
    guard_dtype,
)
from exograv.safety.envelope import Envelope
from exograv.safety.guard import Guard
from exograv.safety.limits import Limits
from exograv.safety.stops import StopReason

EXAMPLE = Path(__file__).parents[2] / "examples" / "drives" / "udp.toml"
RIG = load_rig("recupera_like")
N, GAIN, TAU, PERIOD_NS = len(RIG.joints), 4.0, 2.0, 1_000_000
PAUSE_S = 0.1
"""Pause of a process [s]."""
STARTS_S = 120.0
"""Time limit for two real-time processes to start on a loaded computer [s]."""
PERIODS = 60_000
"""More than any of these runs: each ends because of what happens in it."""


class UnwornRig(UdpRig):
    """Machine that nobody wears: a stop of the guard does not end the run."""

    is_virtual = True


class Push:
    """Control that asks for a torque that shows on the drives."""

    mode_names = ("floating",)

    def answer(self, state: np.void, row: np.ndarray) -> None:
        row["mode"], row["slope"], row["tau"] = 0, 0.0, TAU
        row["v"], row["tau_feedforward"], row["q_reference"] = 0.0, 0.0, np.nan


class Interrupted(Push, ABC):
    """Control that does something else within its 500th answer."""

    def __init__(self):
        self._left = 500

    def answer(self, state: np.void, row: np.ndarray) -> None:
        super().answer(state, row)
        self._left -= 1
        if self._left == 0:
            self._interrupt()

    @abstractmethod
    def _interrupt(self) -> None: ...


class Spin(Interrupted):
    """Control that enters an endless loop."""

    def _interrupt(self) -> None:
        while True:
            pass


class Halting(Interrupted):
    """Control that pauses, for longer than any guard of a machine in real time allows."""

    def _interrupt(self) -> None:
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
        made = Mailbox(state_dtype(N)), Mailbox(answer_dtype(N)), *rings, Ring(guard_dtype(N), RING_GUARDS)
        states, answers, *inlet = [stack.enter_context(contextlib.closing(one)).name for one in made]
        channels = Channels(N, states, answers, Inlet(N, *inlet))
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
