"""Sessions of a campaign: several cells share one session if each of them leaves it alive.

A worker, a recorder, the pages, the listener of LSL and the bridge to ROS 2 may be struck one after another in the same
session. Every other cell ends its session or changes its exit code, and has a session of its own.
"""

from collections.abc import Sequence

from .cell import Cell, Fault, Process, State
from .table import ENDS_WELL, GOES_ON, expected_of, needs_motion

STRIKES_MAX = {State.FLOATING: 8, State.MOVING: 6, State.DESCENDING: 6}
"""Largest number of strikes in one session. A descent takes 3 s, and only its first part is fast."""

REPLACED_MAX = 2
"""Largest number of strikes at the same process of one session: the product replaces only a few in a row."""

HARMLESS = (Fault.TERMINATE,)
"""Faults after which the process goes on unchanged."""


def sessions_of(cells: Sequence[Cell]) -> list[tuple[Cell, ...]]:
    """Return the cells by session. A session is as early as its first cell."""
    sessions: list[list[Cell]] = []
    for cell in cells:
        fits = (one for one in sessions if _fits(cell, one))
        session = next(fits, None)
        if session is None:
            sessions.append([cell])
        else:
            session.append(cell)
    return [tuple(sorted(one, key=_order)) for one in sessions]


def leaves_alive(cell: Cell) -> bool:
    """Return True if the session goes on after this cell, and ends as if it had not been struck."""
    expected = expected_of(cell)
    return expected.outcomes == GOES_ON and expected.exits == ENDS_WELL


def _fits(cell: Cell, session: Sequence[Cell]) -> bool:
    first = session[0]
    if not (leaves_alive(cell) and leaves_alive(first)) or len(session) >= STRIKES_MAX[cell.state]:
        return False
    # A descent may begin in a motion or not.
    needs = cell.state is State.DESCENDING or needs_motion(cell) == needs_motion(first)
    if (cell.state, cell.loop) != (first.state, first.loop) or not needs:
        return False
    same = [one for one in session if one.process is cell.process and one.fault not in HARMLESS]
    if cell.fault in HARMLESS or not same:
        return True
    if cell.state is State.DESCENDING or len(same) >= REPLACED_MAX:
        return False
    # One of a session may be the last of its process; those before it have to be replaced first.
    return sum(not expected_of(one).is_replaced for one in (*same, cell)) <= 1


def _order(cell: Cell) -> tuple[bool, bool, bool]:
    """Sort strikes: a full disk ends the recording, and a process that is not replaced cannot be struck again."""
    is_last = cell.fault not in HARMLESS and not expected_of(cell).is_replaced
    is_guard_like = cell.process in (Process.GUARD, Process.CONTROL)
    return cell.fault is Fault.DISK, is_guard_like, is_last
