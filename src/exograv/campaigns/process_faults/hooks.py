"""Hooks of the campaign inside the processes of its own session; no other session loads this module.

The session of the campaign starts each process through `struck_target`. The hook waits for a signal, then acts within
the next tick of the process. All other faults come from outside, as signals and limits of the kernel.
"""

import importlib
import os
import signal
import struct
import sys
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
    Process.GUARD: ("exograv.live.native_guard:NativeGuard.supervise", "exograv.live.guard_process:GuardLoop._tick"),
    Process.CONTROL: ("exograv.live.live_control:LiveControl.answer",),
    Process.WORKER: ("exograv.runtime.control_loop.worker:_Desk.work",),
    Process.RECORDER: ("exograv.runtime.recorder.recorder_process:_Desk.take",),
    Process.PARENT: ("exograv.runtime.recorder.recorder:Recorder.check",),
    Process.CONSOLE: ("exograv.console.desk_link:DeskClient.shown",),
    Process.LSL: ("exograv.runtime.lsl.listener:_Line.note",),
    Process.ROS2: ("exograv.runtime.ros2.bridge:Bridge.publish",),
}
"""Functions that are one tick of a process. The loop in C has no tick in Python; its supervisor is struck instead."""

FULL_BYTES = 8_000_000
"""Size of a message that fills every pipe [byte]."""

SENDERS: dict[str, tuple[str, str]] = {
    Process.GUARD: ("exograv.runtime.control_loop.guard_commands:GuardLine.beat", "_messages"),
    Process.PARENT: ("exograv.runtime.control_loop.guard_commands:GuardInbox.why_gone", "_replies"),
    Process.CONSOLE: ("exograv.console.desk_link:DeskClient.shown", "_requests"),
}
"""Function that a sender calls for each message, and its attribute with the shared memory, by struck process."""

NAMES: dict[str, Process] = {"listener": Process.LSL, "pages": Process.CONSOLE}
"""Processes of the product that have another name in the matrix."""

DRIVES_MAX_S = 60.0
"""Longest time in which the guard waits for the start of the simulated drives [s]."""

UNREAD_S = 4.0
"""Time for which the parent reads no message [s]."""


class StrikeInTickError(Exception):
    """Exception of the campaign, raised inside a tick."""


class Hook:
    """Faults that wait in one process for their signal. A note of the campaign names the fault that is due."""

    def __init__(self, orders: FlightOrders, process: Process, line_to: Callable[[Process], Connection | None]):
        """Wait for no fault yet; `line_to` returns the line on which `process`, this one, sends to another one."""
        self._folder, self._process, self._line_to = orders.folder, process, line_to
        self._in_tick: Fault | None = None
        self._half_message = threading.Event()

    def due(self, *_: object) -> None:
        """Handle the signal: strike at once, or in the next tick."""
        cell = Cell.of([note["cell"] for note in read_notes(self._folder) if note["kind"] == "strike"][-1])
        line = self._line_to(cell.process)
        if cell.fault in (Fault.SPIN, Fault.EXCEPTION):
            self._in_tick = cell.fault
        elif cell.fault is Fault.HALF_MESSAGE:
            self._half_message.set()
        elif cell.fault is Fault.HALF_WORD and line is not None:
            write_half_word(self._folder, line)
        elif cell.fault is Fault.FULL_PIPE and cell.process is Process.PARENT:
            fill_terminal(self._folder)
        elif cell.fault is Fault.FULL_PIPE and self._process is Process.PARENT:
            read_nothing(self._folder)
        elif cell.fault is Fault.FULL_PIPE and line is not None:
            fill_pipe(self._folder, line)

    def within(self, tick: Callable[..., Any]) -> Callable[..., Any]:
        """Return the tick with the fault in it."""

        @wraps(tick)
        def struck(*arguments: Any, **named: Any) -> Any:
            fault, self._in_tick = self._in_tick, None
            if fault is not None:
                self._act(fault)
            return tick(*arguments, **named)

        return struck

    def before(self, sends: Callable[..., Any], memory: str) -> Callable[..., Any]:
        """Return the function that sends messages, which writes half a message first when it is due."""

        @wraps(sends)
        def struck(sender: Any, *arguments: Any) -> Any:
            if self._half_message.is_set():
                self._half_message.clear()
                write_note(self._folder, "struck")
                write_half_message(getattr(sender, memory))
            return sends(sender, *arguments)

        return struck

    def _act(self, fault: Fault) -> None:
        write_note(self._folder, "struck")
        if fault is Fault.EXCEPTION:
            raise StrikeInTickError("The campaign of process faults raises this exception inside a tick.")
        while True:
            pass


def acting(cell: Cell) -> tuple[Process, ...]:
    """Return the processes whose hooks make the fault of a cell: the sender of a half-written word or message."""
    process, fault = cell.process, cell.fault
    if fault is Fault.FULL_PIPE and process is Process.GUARD:
        return Process.PARENT, Process.GUARD
    sends_itself = fault is Fault.HALF_WORD and process in (Process.LSL, Process.ROS2)
    if fault not in (Fault.HALF_WORD, Fault.HALF_MESSAGE) or sends_itself or process is Process.CONSOLE:
        return (process,)
    return (Process.GUARD if process is Process.PARENT else Process.PARENT,)


def struck_target(name: str, target: Callable[[Any, Connection], object], job: Any, line: Connection) -> None:
    """Run `target` in a process of the session, with the campaign's notes and hook."""
    orders = FlightOrders.read(Path(os.environ[ORDERS]))
    process = NAMES.get(name) or Process(name)
    write_note(orders.folder, "process", name=process, pid=os.getpid())
    if process is Process.GUARD:
        write_note(orders.folder, "ring", name=job.channels.inlet.tick_ring)
        job = replace(job, build=partial(announcing, orders.folder, job.build))
    install(orders, process, lambda _: line)
    target(job, line)


def install(orders: FlightOrders, process: Process, line_to: Callable[[Process], Connection | None]) -> None:
    """Put the faults that this process makes into it.

    Raises:
        ConfigError: The product has no such function any more.
    """
    cells = [cell for cell in orders.struck if process in acting(cell)]
    if not cells:
        return
    hook = Hook(orders, process, line_to)
    signal.signal(STRIKE, hook.due)
    for cell in cells:
        if cell.fault is Fault.HALF_MESSAGE:
            place, memory = SENDERS[cell.process]
            owner, name = tick_of(place)
            setattr(owner, name, hook.before(getattr(owner, name), memory))
    if any(cell.fault in (Fault.SPIN, Fault.EXCEPTION) for cell in cells):
        for place in TICKS[process]:
            owner, name = tick_of(place)
            setattr(owner, name, hook.within(getattr(owner, name)))


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


def fill_terminal(folder: str) -> None:
    """Write more to the terminal than a reader who has stopped reading lets through."""
    write_note(folder, "struck")
    sys.stderr.write("A long line of the session. " * 40_000 + "\n")
    sys.stderr.flush()


def read_nothing(folder: str) -> None:
    """Keep the parent from reading any message for a while."""
    write_note(folder, "unread")
    until = time.monotonic() + UNREAD_S
    while time.monotonic() < until:
        time.sleep(0.01)
