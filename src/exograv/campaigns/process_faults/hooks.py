"""Hooks of the campaign inside the processes of its own session; no other session loads this module.

The session of the campaign starts each process through `struck_target`. The hook waits for a signal, then acts within
the next tick of the process. All other faults come from outside, as signals and limits of the kernel.
"""

import importlib
import os
import signal
import struct
import threading
import time
from collections.abc import Callable
from dataclasses import is_dataclass, replace
from functools import partial, wraps
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any

from exograv.errors import ConfigError
from exograv.runtime.processes.shared_memory import PART_BYTES, MessageRing

from .cell import ORDERS, Cell, Fault, FlightOrders, Process
from .notes import read_notes, write_note

STRIKE = getattr(signal, "SIGUSR1", signal.SIGTERM)  # Windows has no SIGUSR1, and the campaign needs Linux

TICKS: dict[str, tuple[str, ...]] = {
    Process.GUARD: ("exograv.live.native_guard:NativeGuard.supervise", "exograv.live.guard_process:GuardLoop.tick"),
    Process.CONTROL: ("exograv.live.live_control:LiveControl.answer",),
    Process.WORKER: ("exograv.runtime.control_loop.worker:_Desk.work",),
    Process.RECORDER: ("exograv.runtime.recorder.recorder_process:_Desk.take",),
    Process.PARENT: ("exograv.runtime.recorder.recorder:Recorder.check",),
}
"""Functions that are one tick of a process. The loop in C has no tick in Python; its supervisor is struck instead."""

FULL_BYTES = 8_000_000
"""Size of a message that fills every pipe [byte]."""

SENDERS: dict[str, tuple[str, str]] = {
    Process.GUARD: ("exograv.runtime.control_loop.guard_commands:GuardLine.beat", "_messages"),
    Process.PARENT: ("exograv.runtime.control_loop.guard_commands:GuardInbox.why_gone", "_replies"),
}
"""Function that the sender of messages in shared memory calls again and again, and the memory, by receiver."""

DRIVES_MAX_S = 60.0
"""Longest time in which the guard waits for the start of the simulated drives [s]."""

UNREAD_S = 4.0
"""Time for which the parent reads no message [s]."""


class StrikeInTickError(Exception):
    """Exception of the campaign, raised inside a tick."""


class Hook:
    """Fault that waits in one process for its signal."""

    def __init__(self, orders: FlightOrders, fault: Fault):
        self._folder, self._fault, self._is_due = orders.folder, fault, False

    def due(self, *_: object) -> None:
        """Handle the signal: strike in the next tick."""
        self._is_due = True

    def within(self, tick: Callable[..., Any]) -> Callable[..., Any]:
        """Return the tick with the fault in it."""

        @wraps(tick)
        def struck(*arguments: Any, **named: Any) -> Any:
            if self._is_due:
                self._is_due = False
                self._act()
            return tick(*arguments, **named)

        return struck

    def _act(self) -> None:
        write_note(self._folder, "struck")
        if self._fault is Fault.EXCEPTION:
            raise StrikeInTickError("The campaign of process faults raises this exception inside a tick.")
        while True:
            pass


def struck_target(name: str, target: Callable[[Any, Connection], object], job: Any, line: Connection) -> None:
    """Run `target` in a process of the session, with the campaign's notes and hook."""
    orders = FlightOrders.read(Path(os.environ[ORDERS]))
    cell = Cell.of(orders.cell)
    write_note(orders.folder, "process", name=name, pid=os.getpid())
    if name == Process.GUARD:
        write_note(orders.folder, "ring", name=job.channels.inlet.tick_ring)
        job = replace(job, build=partial(announcing, orders.folder, job.build))
    if name == cell.process:
        install(orders, cell)
    if cell.fault is Fault.HALF_WORD and cell.process is Process.PARENT and name == Process.GUARD:
        signal.signal(STRIKE, lambda *_: write_half_word(orders.folder, line))
    if cell.fault is Fault.HALF_MESSAGE and cell.process is Process.PARENT and name == Process.GUARD:
        install_half_message(orders, cell)
    if cell.fault is Fault.FULL_PIPE and name == cell.process:
        signal.signal(STRIKE, lambda *_: fill_pipe(orders.folder, line))
    target(job, line)


def install(orders: FlightOrders, cell: Cell) -> None:
    """Put the fault of the cell into the ticks of this process.

    Raises:
        ConfigError: The product has no such function any more.
    """
    hook = Hook(orders, cell.fault)
    signal.signal(STRIKE, hook.due)
    if cell.fault not in (Fault.SPIN, Fault.EXCEPTION):
        return
    for place in TICKS[cell.process]:
        owner, name = tick_of(place)
        setattr(owner, name, hook.within(getattr(owner, name)))


def install_half_message(orders: FlightOrders, cell: Cell) -> None:
    """Let this process write half a message to the struck process, after its signal.

    Raises:
        ConfigError: The product has no such function any more.
    """
    place, memory = SENDERS[cell.process]
    owner, name = tick_of(place)
    sends, is_due = getattr(owner, name), threading.Event()
    signal.signal(STRIKE, lambda *_: is_due.set())

    @wraps(sends)
    def struck(sender: Any, *arguments: Any) -> Any:
        if is_due.is_set():
            is_due.clear()
            write_note(orders.folder, "struck")
            write_half_message(getattr(sender, memory))
        return sends(sender, *arguments)

    setattr(owner, name, struck)


def write_half_message(ring: MessageRing) -> None:
    """Count a message as written of which only the first bytes are there."""
    block, written = ring._block, int(ring._block.head["written"][0])
    block.rows[written % len(block.rows)] = (PART_BYTES // 2, 0, b"half")
    block.head["written"] = written + 1


def tick_of(place: str) -> tuple[type, str]:
    """Return the class and the name of a function in `TICKS`.

    Raises:
        ConfigError: The product has no such function any more.
    """
    module, _, path = place.partition(":")
    owner, _, name = path.partition(".")
    found = getattr(importlib.import_module(module), owner, None)
    if not isinstance(found, type) or not hasattr(found, name):
        raise ConfigError(f"Process faults: {place} does not exist. Correct the table TICKS in {__name__}.")
    return found, name


def announcing(folder: str, build: Callable[[], Any]) -> Any:
    """Build the guarded rig, which notes each mode that begins, when the drives are there."""
    until = time.monotonic() + DRIVES_MAX_S
    while not any(note["kind"] == "drives" for note in read_notes(folder)) and time.monotonic() < until:
        time.sleep(0.02)
    made = build()
    assert is_dataclass(made)
    return replace(made, announce=lambda mode: write_note(folder, "mode", name=mode))  # type: ignore[type-var] - the assertion above does not tell pyright the class


def write_half_word(folder: str, line: Connection) -> None:
    """Write the length of a message and the first bytes of it, and never the rest."""
    os.write(line.fileno(), struct.pack("!i", 1000) + b"half")
    write_note(folder, "struck")


def fill_pipe(folder: str, line: Connection) -> None:
    """Send a message larger than any pipe; return when the other end has read it."""
    write_note(folder, "struck")
    line.send(bytes(FULL_BYTES))


def read_nothing(folder: str) -> None:
    """Keep the parent from reading any message for a while."""
    write_note(folder, "unread")
    until = time.monotonic() + UNREAD_S
    while time.monotonic() < until:
        time.sleep(0.01)
