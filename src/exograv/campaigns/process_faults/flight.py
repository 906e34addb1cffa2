"""Flight of one session: drives and session in processes of their own, the state, the strike, and the end."""

import signal
import time
import urllib.request
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from http import HTTPStatus
from pathlib import Path
from typing import Any

import numpy as np

from exograv.errors import RecordingError
from exograv.model.description import RigDescription
from exograv.procedures.bring_up.simulated_drives_file import written
from exograv.recording import read_recording
from exograv.runtime.recorder.recorder import HANGS_S

from .bare_loops import bare_loops
from .cell import Cell, Fault, FlightOrders, Process, State
from .drives import DrivesLog
from .drives_process import DrivesProcess
from .evidence import FlightEvidence, RecordedTicks
from .neighbours import neighbours
from .notes import write_note
from .strikes import IN_HOOK, Target, strike
from .struck_session import Session, struck_session
from .table import Outcome, expected_of, needs_motion
from .watching import end_all, forget_memory, is_running, left_memory, send_all

STATE_MAX_S = 90.0
"""Longest time from the start of the session to the state [s]."""

SETTLED_S, INTO_DESCENT_S = 0.6, 0.4
"""Time in a state before the strike, and time in a descent before it [s]."""

GOES_ON_S, ENDS_S, STOPS_S = 2.5, 9.0, 45.0
"""Time in which a session must go on; in which it must end by itself; and in which it must end after Stop [s]."""

AFTER_GUARD_S = 2.0
"""Time for the command to end after its guard [s]."""

IN_DESCENT_S, HOOK_S = 0.3, 5.0
"""Time between two strikes in a descent, and time for a hook to act [s]. A hook waits for the next tick."""

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


def fly(cells: Sequence[Cell], ground: Ground, folder: Path) -> Callable[[], list[FlightEvidence]]:
    """Fly these cells in one session in `folder`, one strike after another.

    The result reads what happened, by cell. It takes seconds, in which the next session may already start.
    """
    folder.mkdir(parents=True, exist_ok=True)
    drives = written(folder, ground.description)
    log = folder / "drives.npz"
    log.unlink(missing_ok=True)
    of_machine = (ground.description.folder, ground.level, ground.wearer_seed)
    process = DrivesProcess([str(word) for word in (drives, *of_machine, log)])
    has = {cell.process for cell in cells}
    try:
        with bare_loops() as pauses, neighbours(Process.LSL in has, Process.ROS2 in has) as router:
            strikes, common = _flown(cells, ground, drives, router, folder)
    except BaseException:
        process.end()
        raise
    common["host_pauses"] = None if pauses is None else tuple(pauses)
    return partial(_evidence, process, log, strikes, common)


def _evidence(
    process: DrivesProcess, log: Path, strikes: Sequence["Strike"], common: Mapping[str, Any]
) -> list[FlightEvidence]:
    """Read what the drives and the recorder have written.

    Raises:
        RigError: The simulated drives did not start.
    """
    process.end()
    process.refuse_dead()
    ticks, why = _recorded(log.parent / "live.mcap")
    at_drives = DrivesLog.read(log)
    return [FlightEvidence(at_drives, ticks=ticks, recording_why=why, **common, **vars(one)) for one in strikes]


@dataclass
class Strike:
    """Strike of one cell, as the judge sees it; the fields are those of `FlightEvidence`."""

    struck_t: float | None = None
    stopped_before: str = ""
    released_t: float | None = None
    resumed_t: float | None = None
    replaced_t: float | None = None
    ended_s: float | None = None
    has_silent_pages: bool = False


def _flown(
    cells: Sequence[Cell], ground: Ground, drives: Path, router: str, folder: Path
) -> tuple[list[Strike], dict[str, Any]]:
    motion_s = max(10.0, 3.0 + GOES_ON_S * len(cells)) if any(map(needs_motion, cells)) else 0.0
    orders = folder / "orders.json"
    names, loop_s = tuple(cell.name for cell in cells), 60.0 + 2.0 * REPLACES_S
    FlightOrders(names, str(folder), str(ground.participant), str(drives), loop_s, motion_s, router).write(orders)
    with struck_session(orders, folder, cells[0].loop) as session:
        why, pressed = _brought_into(cells, session)
        strikes = [Strike(stopped_before=why) for _ in cells]
        session.look_at_memory()
        exit_code = None
        if not why:
            exit_code = _struck_all(cells, strikes, session)
        ended = time.monotonic()
        left = [] if why else end_all(orders, LEFT_S)
        end_all(orders, 0.0)
    output = b"".join(session.output).decode(errors="replace")
    (folder / "terminal.txt").write_text(output, encoding="utf-8")
    left_in_memory = left_memory(session.memory)
    forget_memory(left_in_memory)
    names_of = {int(note["pid"]): str(note["name"]) for note in session.notes("process")}
    for cell, one in zip(cells, strikes, strict=True):
        if (struck_t := one.struck_t) is not None:
            one.ended_s, one.replaced_t = ended - struck_t, _replaced_at(cell.process, struck_t, session)
    return strikes, {
        "pressed_t": pressed, "exit_code": exit_code, "acknowledged": session.acknowledged, "output": output,
        "left_processes": tuple(names_of.get(pid, "another") for pid in left), "left_memory": tuple(left_in_memory),
    }  # fmt: skip


def _brought_into(cells: Sequence[Cell], session: Session) -> tuple[str, float | None]:
    """Wait for the state; return the reason why it was not reached (or empty), and the time of Stop."""
    for mode in _way(cells):
        if why := _await_mode(session, mode):
            return why, None
    for process in {cell.process for cell in cells} & {Process.CONSOLE}:
        if not _awaited(session, lambda process=process: process in _pids(session)):
            return f"the process {process} did not start", None
    time.sleep(SETTLED_S)
    if "safe" in session.modes or session.process.poll() is not None:
        return "the guard stopped the machine before the strike", None
    if cells[0].state is not State.DESCENDING:
        return "", None
    pressed = session.press_stop()
    time.sleep(INTO_DESCENT_S)
    return "", pressed


def _way(cells: Sequence[Cell]) -> tuple[str, ...]:
    """Modes on the way to the state of these cells."""
    if not any(map(needs_motion, cells)):
        return ("floating",)
    return ("moving", "floating") if cells[0].state is State.FLOATING else ("moving",)


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


def _awaited(session: Session, condition: Callable[[], bool], within_s: float = REPLACES_S) -> bool:
    """Wait for a condition while the session runs; return True if it came true."""
    until = time.monotonic() + within_s
    while not condition():
        if session.process.poll() is not None or time.monotonic() > until:
            return False
        session.look()
    return True


def _pids(session: Session) -> dict[str, int]:
    """Return the newest process of each name."""
    return {note["name"]: int(note["pid"]) for note in session.notes("process")}


def _replaced_at(process: Process, struck_t: float, session: Session) -> float | None:
    """Time at which the next process of this name noted its start [s]; None if there was none."""
    times = (float(one["t"]) for one in session.notes("process") if one["name"] == process)
    return next((t for t in times if t > struck_t), None)


def _struck_all(cells: Sequence[Cell], strikes: list[Strike], session: Session) -> int | None:
    """Strike one process after another, then press Stop; return the exit code of the command."""
    *before, last = range(len(cells))
    for number in before:
        if why := _why_not_struck(number, cells, strikes, session):
            strikes[number].stopped_before = why
            continue
        _strike_one(cells[number], strikes[number], session)
        pause_s = IN_DESCENT_S if cells[number].state is State.DESCENDING else GOES_ON_S
        if session.await_end(pause_s):
            for one in strikes[number + 1 :]:
                one.stopped_before = "the session ended before the strike"
            return session.process.poll()
        # What happens from now on may come from the next strike.
        strikes[number].released_t = time.monotonic()
    if not (why := _why_not_struck(last, cells, strikes, session)):
        return _struck_last(cells, strikes, session)
    strikes[last].stopped_before = why
    if "safe" not in session.modes:  # otherwise the session ends by itself
        session.press_stop()
    return session.process.poll() if session.await_end(STOPS_S) else None


def _why_not_struck(number: int, cells: Sequence[Cell], strikes: list[Strike], session: Session) -> str:
    """Wait for the process that replaces one that was struck before; return the reason if none can be struck."""
    cell = cells[number]
    if cell.state is State.DESCENDING:
        return ""
    times = [
        one.struck_t
        for earlier, one in zip(cells[:number], strikes, strict=False)
        if earlier.process is cell.process and expected_of(earlier).is_replaced and one.struck_t is not None
    ]
    if times and not _awaited(session, lambda: _replaced_at(cell.process, times[-1], session) is not None):
        return "the process that was struck before was not replaced"
    if cell.process is Process.CONSOLE:
        _note_silent_pages(cells[:number], strikes, session)
    # The motion may be over, and the guard may have stopped the machine.
    mode = session.modes[-1:]
    return "" if mode == [cell.state] else f"the machine was not {cell.state} any more"


def _strike_one(cell: Cell, one: Strike, session: Session) -> None:
    """Strike, and wait until a hook has noted the time at which it acted."""
    if cell.fault is Fault.FULL_PIPE and cell.process is Process.PARENT:
        session.may_read.clear()
    before = len(session.notes("struck"))
    write_note(session.folder, "strike", cell=cell.name)
    try:
        made = strike(cell, Target(_pids(session), session.look_at_memory(), session.folder / "live.mcap"))
    except ProcessLookupError:
        one.stopped_before = f"the process {cell.process} had ended"
        return
    one.struck_t, one.resumed_t = made.t, made.resumed_t
    if cell.fault in IN_HOOK:
        _awaited(session, lambda: len(session.notes("struck")) > before, HOOK_S)
        notes = session.notes("struck")[before:]
        one.struck_t = float(notes[0]["t"]) if notes else None


def _struck_last(cells: Sequence[Cell], strikes: list[Strike], session: Session) -> int | None:
    cell, one = cells[-1], strikes[-1]
    expected = expected_of(cell)
    _strike_one(cell, one, session)
    goes_on = cell.state is not State.DESCENDING and Outcome.GOES_ON in expected.outcomes
    ends_s = REPLACES_S if any(each.process is Process.RECORDER for each in cells) else ENDS_S
    guard = _pids(session)[Process.GUARD]
    if not goes_on and cell.process in (Process.PARENT, Process.SESSION):
        # A parent that stands still does not end by itself. The descent is over when the guard has ended.
        _awaited(session, lambda: not is_running(guard), ends_s)
        has_ended = session.await_end(AFTER_GUARD_S)
    else:
        has_ended = session.await_end(GOES_ON_S if goes_on else ends_s)
    if goes_on and not has_ended:
        for each, struck in zip(cells, strikes, strict=True):
            if expected_of(each).is_replaced and (struck_t := struck.struck_t) is not None:
                _awaited(session, lambda each=each, t=struck_t: _replaced_at(each.process, t, session) is not None)
        _note_silent_pages(cells, strikes, session)
        has_ended = session.process.poll() is not None
    if not has_ended and not is_running(guard) and cell.process not in (Process.PARENT, Process.SESSION):
        has_ended = session.await_end(STOPS_S)  # Stop has nothing left to stop, and a struck parent may need it
    if not has_ended:
        session.may_read.set()
        pids = session.look_at_memory()
        stopped = [] if cell.process is Process.GUARD else pids
        if stands_still(cell):
            send_all(stopped, signal.SIGCONT)
        one.released_t = session.press_stop()
        has_ended = session.await_end(STOPS_S)
    session.may_read.set()
    return session.process.poll() if has_ended else None


def stands_still(cell: Cell) -> bool:
    """Return True if the parent stands still until it is woken."""
    return cell.process in (Process.PARENT, Process.SESSION) and cell.fault in (Fault.CTRL_Z, Fault.STOP)


def _note_silent_pages(cells: Sequence[Cell], strikes: list[Strike], session: Session) -> None:
    """Note pages that do not answer at their first address after the last strike at them.

    Call this before each further strike at the pages, so that the right strike gets the blame.
    """
    at_pages = [
        one
        for each, one in zip(cells, strikes, strict=False)
        if each.process is Process.CONSOLE and one.struck_t is not None
    ]
    if not at_pages:
        return
    host = str(session.notes("page")[0]["host"])
    if not _awaited(session, lambda: _answers(host)) and session.process.poll() is None:
        at_pages[-1].has_silent_pages = True


def _answers(host: str) -> bool:
    try:
        with urllib.request.urlopen(f"http://{host}/", timeout=1.0) as page:
            return page.status == HTTPStatus.OK
    except OSError:
        return False


def _recorded(path: Path) -> tuple[RecordedTicks | None, str]:
    try:
        recording = read_recording(path)
    except (RecordingError, OSError) as error:
        return None, str(error)
    ticks = recording.ticks
    stop = next((str(event["text"]) for event in recording.messages("/event") if event["kind"] == "stop"), "")
    states = ticks["safe_state"].astype(int) - 1
    return RecordedTicks(ticks["monotonic"].astype(float), states, ticks["sequence"].astype(np.int64), stop), ""
