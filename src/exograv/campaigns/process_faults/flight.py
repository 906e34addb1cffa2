"""Flight of one cell: drives and session in processes of their own, the state, the strike, and the end."""

import signal
import time
from collections import Counter
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from exograv.errors import RecordingError
from exograv.model.description import RigDescription
from exograv.procedures.bring_up.simulated_drives_file import written
from exograv.recording import read_recording
from exograv.runtime.recorder.recorder import HANGS_S

from .cell import Cell, Fault, FlightOrders, Process, State
from .drives import DrivesLog
from .drives_process import DrivesProcess
from .evidence import FlightEvidence, RecordedTicks
from .strikes import IN_HOOK, Struck, Target, strike
from .struck_session import Session, struck_session
from .table import Expected, Outcome, needs_motion
from .watching import end_all, forget_memory, left_memory, memory_of, processes_of, send_all

STATE_MAX_S = 90.0
"""Longest time from the start of the session to the state [s]."""

SETTLED_S, INTO_DESCENT_S = 0.6, 0.4
"""Time in a state before the strike, and time in a descent before it [s]."""

GOES_ON_S, ENDS_S, STOPS_S = 2.5, 9.0, 45.0
"""Time in which a session must go on; in which it must end by itself; and in which it must end after Stop [s]."""

REPLACES_S = HANGS_S + 4.0
"""Time in which a session must end by itself whose recorder hangs and has to be replaced first [s]."""

LEFT_S = 8.0
"""Time after the end of the command until all its processes have ended [s]: a killed parent leaves a descent of 3 s."""


@dataclass(frozen=True)
class Ground:
    """Participant and machine of all flights."""

    participant: Path
    description: RigDescription
    level: int
    wearer_seed: int


def fly(cell: Cell, expected: Expected, ground: Ground, folder: Path) -> FlightEvidence:
    """Fly one cell in `folder`, and return what happened.

    Raises:
        RigError: The simulated drives do not start.
    """
    folder.mkdir(parents=True, exist_ok=True)
    drives = written(folder, ground.description)
    log = folder / "drives.npz"
    log.unlink(missing_ok=True)
    of_machine = (ground.description.folder, ground.level, ground.wearer_seed)
    process = DrivesProcess([str(word) for word in (drives, *of_machine, log)])
    try:
        evidence = _flown(cell, expected, ground, drives, folder)
    finally:
        process.end()
    process.refuse_dead()
    ticks, why = _recorded(folder / "live.mcap")
    return FlightEvidence(DrivesLog.read(log), ticks=ticks, recording_why=why, **evidence)


def _flown(cell: Cell, expected: Expected, ground: Ground, drives: Path, folder: Path) -> dict[str, Any]:
    motion_s = 10.0 if needs_motion(cell) else 0.0
    orders = folder / "orders.json"
    FlightOrders(cell.name, str(folder), str(ground.participant), str(drives), 60.0, motion_s).write(orders)
    with struck_session(orders, folder) as session:
        why, pressed = _brought_into(cell, session)
        found: dict[str, Any] = {"struck_t": None, "stopped_before": why, "pressed_t": pressed}
        memory = memory_of(list(processes_of(orders)))
        if not why:
            found |= _struck(cell, expected, session)
        ended = time.monotonic()
        left = [] if why else end_all(orders, LEFT_S)
        end_all(orders, 0.0)
    output = b"".join(session.output).decode(errors="replace")
    (folder / "terminal.txt").write_text(output, encoding="utf-8")
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
    for mode in _way(cell):
        if why := _await_mode(session, mode):
            return why, None
    time.sleep(SETTLED_S)
    if "safe" in session.modes or session.process.poll() is not None:
        return "the guard stopped the machine before the strike", None
    if cell.state is not State.DESCENDING:
        return "", None
    pressed = session.press_stop()
    time.sleep(INTO_DESCENT_S)
    return "", pressed


def _way(cell: Cell) -> tuple[str, ...]:
    """Modes on the way to the state of a cell."""
    if not needs_motion(cell):
        return ("floating",)
    return ("moving", "floating") if cell.state is State.FLOATING else ("moving",)


def _await_mode(session: Session, mode: str) -> str:
    """Wait until a mode is the present one; return the reason if it does not come, or empty."""
    until = time.monotonic() + STATE_MAX_S
    while (modes := session.modes)[-1:] != [mode]:
        if session.process.poll() is not None or time.monotonic() > until:
            return f"the session did not reach the mode {mode}"
        if "safe" in modes:
            return f"the guard stopped the machine before the mode {mode}"
        session.look()
    return ""


def _struck(cell: Cell, expected: Expected, session: Session) -> dict[str, Any]:
    pids = {note["name"]: int(note["pid"]) for note in session.notes("process")}
    if cell.fault is Fault.FULL_PIPE and cell.process is Process.PARENT:
        session.may_read.clear()
    made = strike(cell, Target(pids, list(processes_of(session.orders)), session.folder / "live.mcap"))
    goes_on = cell.state is not State.DESCENDING and Outcome.GOES_ON in expected.outcomes
    ends_s = REPLACES_S if cell.process is Process.RECORDER else ENDS_S
    has_ended = session.await_end(GOES_ON_S if goes_on else ends_s)
    found: dict[str, Any] = {"struck_t": _time_of(cell, made, session), "resumed_t": made.resumed_t}
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


def _recorded(path: Path) -> tuple[RecordedTicks | None, str]:
    try:
        recording = read_recording(path)
    except (RecordingError, OSError) as error:
        return None, str(error)
    ticks = recording.ticks
    stop = next((str(event["text"]) for event in recording.messages("/event") if event["kind"] == "stop"), "")
    states = ticks["safe_state"].astype(int) - 1
    return RecordedTicks(ticks["monotonic"].astype(float), states, ticks["sequence"].astype(np.int64), stop), ""
