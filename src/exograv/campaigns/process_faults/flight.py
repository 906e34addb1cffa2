"""Flight of one cell: drives and session in processes of their own, the state, the strike, and the end."""

import contextlib
import os
import signal
import subprocess
import sys
import threading
import time
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from exograv.errors import RecordingError, RigError
from exograv.live.on_drives.simulated_drives import GREETING
from exograv.model.description import RigDescription
from exograv.procedures.bring_up.simulated_drives_file import written
from exograv.recording import read_recording
from exograv.rig.drives.settings import load_drives

from .cell import ORDERS, Cell, Fault, FlightOrders, Process, State
from .drives import DrivesLog
from .evidence import FlightEvidence, RecordedTicks
from .notes import read_notes
from .strikes import IN_HOOK, Struck, Target, strike
from .table import Expected, Outcome, needs_motion
from .watching import acknowledged_ticks, end_all, forget_memory, left_memory, memory_of, processes_of, send_all

STATE_MAX_S = 90.0
"""Longest time from the start of the session to the state [s]."""

SETTLED_S, INTO_DESCENT_S = 0.6, 0.4
"""Time in a state before the strike, and time in a descent before it [s]."""

GOES_ON_S, ENDS_S, STOPS_S = 2.5, 9.0, 12.0
"""Time in which a session must go on; in which it must end by itself; and in which it must end after Stop [s]."""

LEFT_S = 2.0
"""Time after the end of the command until all its processes have ended [s]."""

LOOK_S = 0.02

LOG_MAX_S = 20.0
"""Time in which the drives write their log [s]."""


@dataclass(frozen=True)
class Ground:
    """Participant and machine of all flights."""

    participant: Path
    description: RigDescription
    level: int
    wearer_seed: int


@dataclass
class Session:
    """Session of a flight, seen from outside."""

    process: "subprocess.Popen[bytes]"
    orders: Path
    folder: Path
    output: list[bytes] = field(default_factory=list)
    may_read: threading.Event = field(default_factory=threading.Event)
    acknowledged: int = 0

    def read(self) -> None:
        """Read the terminal's output until its end; pause while `may_read` is not set."""
        assert self.process.stdout is not None
        while self.may_read.wait() and (data := os.read(self.process.stdout.fileno(), 65536)):
            self.output.append(data)

    def look(self) -> None:
        """Note what is acknowledged now, then wait a little."""
        for note in self.notes("ring"):
            self.acknowledged = acknowledged_ticks(note["name"], self.acknowledged)
        time.sleep(LOOK_S)

    def notes(self, kind: str) -> list[dict]:
        """Return the notes of one kind so far."""
        return [note for note in read_notes(self.folder) if note["kind"] == kind]

    def await_end(self, within_s: float) -> bool:
        """Return True if the command ends in time."""
        until = time.monotonic() + within_s
        while self.process.poll() is None and time.monotonic() < until:
            self.look()
        return self.process.poll() is not None

    def press_stop(self) -> float:
        """Press Ctrl-C at the terminal of the session; return the time."""
        t = time.monotonic()
        with contextlib.suppress(ProcessLookupError):
            os.killpg(self.process.pid, signal.SIGINT)
        return t


def fly(cell: Cell, expected: Expected, ground: Ground, folder: Path) -> FlightEvidence:
    """Fly one cell in `folder`, and return what happened.

    Raises:
        RigError: The simulated drives do not start.
    """
    folder.mkdir(parents=True, exist_ok=True)
    drives = written(folder, ground.description)
    log = folder / "drives.npz"
    log.unlink(missing_ok=True)
    process = _Drives(ground, drives, log)
    try:
        evidence = _flown(cell, expected, ground, drives, folder)
    finally:
        process.end()
    process.refuse_dead()
    ticks, why = _recorded(folder / "live.mcap")
    return FlightEvidence(DrivesLog.read(log), ticks=ticks, recording_why=why, **evidence)


def _flown(cell: Cell, expected: Expected, ground: Ground, drives: Path, folder: Path) -> dict:
    motion_s = 10.0 if needs_motion(cell) else 0.0
    orders = folder / "orders.json"
    FlightOrders(cell.name, str(folder), str(ground.participant), str(drives), 60.0, motion_s).write(orders)
    with _session(orders, folder) as session:
        why, pressed = _brought_into(cell, session)
        found: dict = {"struck_t": None, "stopped_before": why, "pressed_t": pressed}
        memory = memory_of(list(processes_of(orders)))
        if not why:
            found |= _struck(cell, expected, session)
        ended = time.monotonic()
        left = [] if why else end_all(orders, LEFT_S)
        end_all(orders, 0.0)
    output = b"".join(session.output).decode(errors="replace")
    left_in_memory = left_memory(memory)
    forget_memory(left_in_memory)
    names = {int(note["pid"]): str(note["name"]) for note in session.notes("process")}
    started = Counter(note["name"] for note in session.notes("process"))
    if found["struck_t"] is not None:
        found["ended_s"] = ended - found["struck_t"]
    return found | {
        "acknowledged": session.acknowledged, "output": output, "restarts": dict(started),
        "left_processes": tuple(names.get(pid, "another") for pid in left), "left_memory": tuple(left_in_memory),
    }  # fmt: skip


def _brought_into(cell: Cell, session: Session) -> tuple[str, float | None]:
    """Wait for the state; return the reason why it was not reached (or empty), and the time of Stop."""
    mode = "moving" if cell.state is State.MOVING or cell.process is Process.WORKER else "floating"
    until = time.monotonic() + STATE_MAX_S
    while not session.notes("mode") or mode not in (modes := [note["name"] for note in session.notes("mode")]):
        if session.process.poll() is not None or time.monotonic() > until:
            return f"the session did not reach the mode {mode}", None
        if "safe" in (note["name"] for note in session.notes("mode")):
            return f"the guard stopped the machine before the mode {mode}", None
        session.look()
    if cell.process is Process.WORKER and cell.state is State.FLOATING:
        while modes[-1] != "floating" and "safe" not in modes and time.monotonic() < until:
            session.look()
            modes = [note["name"] for note in session.notes("mode")]
    time.sleep(SETTLED_S)
    if "safe" in (note["name"] for note in session.notes("mode")) or session.process.poll() is not None:
        return "the guard stopped the machine before the strike", None
    if cell.state is not State.DESCENDING:
        return "", None
    pressed = session.press_stop()
    time.sleep(INTO_DESCENT_S)
    return "", pressed


def _struck(cell: Cell, expected: Expected, session: Session) -> dict:
    pids = {note["name"]: int(note["pid"]) for note in session.notes("process")}
    if cell.fault is Fault.FULL_PIPE and cell.process is Process.PARENT:
        session.may_read.clear()
    made = strike(cell, Target(pids, list(processes_of(session.orders)), session.folder / "live.mcap"))
    has_ended = session.await_end(GOES_ON_S if Outcome.GOES_ON in expected.outcomes else ENDS_S)
    found = {"struck_t": _time_of(cell, made, session), "resumed_t": made.resumed_t}
    if not has_ended:
        session.may_read.set()
        stopped = [] if cell.process is Process.GUARD else list(processes_of(session.orders))
        if cell.fault in (Fault.CTRL_Z, Fault.STOP) and cell.process in (Process.PARENT, Process.SESSION):
            send_all(stopped, signal.SIGCONT)
        found["released_t"] = session.press_stop()
        has_ended = session.await_end(STOPS_S)
    session.may_read.set()
    return found | {"exit_code": session.process.poll() if has_ended else None}


def _time_of(cell: Cell, made: Struck, session: Session) -> float | None:
    """Time of the strike: by the hook's own note, or by the campaign. None if a hook has not acted."""
    if cell.fault not in IN_HOOK:
        return made.t
    notes = session.notes("struck")
    return float(notes[0]["t"]) if notes else None


@contextlib.contextmanager
def _session(orders: Path, folder: Path) -> Iterator[Session]:
    words = [sys.executable, "-m", f"{__package__}.session"]
    environment = {**os.environ, ORDERS: str(orders), "COLUMNS": "200"}
    pipe, nothing = subprocess.PIPE, subprocess.DEVNULL
    # A group of its own in the campaign's terminal session: an orphaned group would ignore Ctrl-Z.
    process = subprocess.Popen(
        words, stdin=nothing, stdout=pipe, stderr=subprocess.STDOUT, env=environment, process_group=0
    )
    session = Session(process, orders, folder)
    session.may_read.set()
    reader = threading.Thread(target=session.read, daemon=True)
    reader.start()
    try:
        yield session
    finally:
        end_all(orders, 0.0)
        process.wait()
        session.may_read.set()
        reader.join(2.0)


class _Drives:
    """Process of the simulated drives. It starts beside the session, which opens its bus seconds later."""

    def __init__(self, ground: Ground, drives: Path, log: Path):
        words = [str(drives), str(ground.description.folder), str(ground.level), str(ground.wearer_seed), str(log)]
        self._process = subprocess.Popen(
            [sys.executable, "-m", f"{__package__}.drives", *words],
            stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, process_group=0,
        )  # fmt: skip
        self.said: list[str] = []
        threading.Thread(target=self._read, daemon=True).start()

    def refuse_dead(self) -> None:
        """Raise a RigError if the drives did not start."""
        if self._process.poll() is not None and GREETING not in "".join(self.said):
            raise RigError(f"The simulated drives of the process faults do not start: {''.join(self.said).strip()}")

    def end(self) -> None:
        """End the drives, which write their log."""
        assert self._process.stdin is not None
        with contextlib.suppress(OSError):
            self._process.stdin.write("quit\n")
            self._process.stdin.flush()
        try:
            self._process.wait(LOG_MAX_S)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()

    def _read(self) -> None:
        assert self._process.stdout is not None
        for line in self._process.stdout:
            self.said.append(line)


def _recorded(path: Path) -> tuple[RecordedTicks | None, str]:
    try:
        ticks = read_recording(path).ticks
    except (RecordingError, OSError) as error:
        return None, str(error)
    states = ticks["safe_state"].astype(int) - 1
    return RecordedTicks(ticks["monotonic"].astype(float), states, ticks["sequence"].astype(np.int64)), ""
