"""Expected outcome of each cell: the one table of this campaign."""

import enum
from collections.abc import Mapping
from dataclasses import dataclass, replace
from itertools import cycle
from types import MappingProxyType

from .cell import Cell, Fault, Loop, Process, State


class Outcome(enum.StrEnum):
    """Reaction to a fault, seen from outside."""

    LOWERED = "lowered"
    """The guard lowers the arm softly, within its descent and the drives' time-out."""

    BRAKED = "braked"
    """The drives brake by their own watchdog, because no command comes any more."""

    GOES_ON = "goes on"
    """The session goes on. It ends as usual when Stop is pressed later."""


ENDS_WELL = (0,)
"""Exit codes of a session that ends by Stop."""


@dataclass(frozen=True)
class Expected:
    """Expected reaction to a fault."""

    outcomes: tuple[Outcome, ...]
    """Outcomes that protect the person."""

    budget_ms: float | None
    """Longest time from the strike to the beginning of a descent or of the brakes [ms]; None if none is required."""

    why: str
    """Reason for this outcome, as a clause."""

    exits: tuple[int, ...] | None = ENDS_WELL
    """Allowed exit codes of the command, negative for a signal; None for any."""

    is_replaced: bool = False
    """True if another process has to take over while the session goes on."""

    told: str = ""
    """Words that the command has to say once at its end, about a process that is not replaced."""


LOWERED, BRAKED, GOES_ON = (Outcome.LOWERED,), (Outcome.BRAKED,), (Outcome.GOES_ON,)
EITHER = (Outcome.GOES_ON, Outcome.LOWERED)

CONTROL_MS = 10.0
"""Budget for a control that is silent, as F15 in docs/explanation/safety.md [ms]."""

DRIVES_MS = 30.0
"""Budget for drives without commands, as F17: their watchdog, and a tick of the drives [ms]."""

ALONE_MS = 2200.0
"""Budget for a silent supervisor of the guard: 2 s, and one turn on a busy computer [ms]."""

PARENT_MS = 400.0
"""Budget for a parent that has ended [ms]: the guard looks at its connection every 200 ticks."""

SILENT_MS = 2600.0
"""Budget for a parent that gives no sign of life [ms]: 2 s, 200 ticks until the guard looks, and a busy computer."""

_P, _F = Process, Fault
_SILENT = "the guard sees no sign of life of the parent"
_UNAWARE = "children take no end signals: only the parent ends a session"
_REPLACED = "it is replaced"
_GONE = "The bridge to ROS 2"

EXPECTED: Mapping[tuple[Process, Fault], Expected] = MappingProxyType(
    {
        (_P.GUARD, _F.KILL): Expected(BRAKED, DRIVES_MS, "no command reaches the drives", (1,)),
        (_P.GUARD, _F.STOP): Expected(BRAKED, DRIVES_MS, "no command reaches the drives", None),
        (_P.GUARD, _F.SPIN): Expected(LOWERED, ALONE_MS, "the loop notes that its supervisor is silent", None),
        (_P.GUARD, _F.TERMINATE): Expected(GOES_ON, None, _UNAWARE),
        (_P.GUARD, _F.EXCEPTION): Expected(LOWERED, PARENT_MS, "an exception of the guard becomes a descent", (0, 1)),
        (_P.GUARD, _F.HALF_WORD): Expected(EITHER, ALONE_MS, "the loop never waits for the rest of a word", None),
        (_P.GUARD, _F.HALF_MESSAGE): Expected(LOWERED, PARENT_MS, "an error of the guard becomes a descent", (0, 1)),
        (_P.GUARD, _F.FULL_PIPE): Expected(EITHER, ALONE_MS, "the loop never waits for the parent to read", None),
        (_P.GUARD, _F.MEMORY): Expected(EITHER, None, "the loop allocates no memory in a tick", None),
        (_P.CONTROL, _F.KILL): Expected(LOWERED, CONTROL_MS, "control is silent"),
        (_P.CONTROL, _F.STOP): Expected(LOWERED, CONTROL_MS, "control is silent"),
        (_P.CONTROL, _F.SPIN): Expected(LOWERED, CONTROL_MS, "control is silent"),
        (_P.CONTROL, _F.TERMINATE): Expected(GOES_ON, None, _UNAWARE),
        (_P.CONTROL, _F.EXCEPTION): Expected(LOWERED, CONTROL_MS, "control ends, so it is silent"),
        (_P.CONTROL, _F.HALF_WORD): Expected(EITHER, 500.0, "control may wait for the rest of the word, and be silent"),
        (_P.CONTROL, _F.MEMORY): Expected(EITHER, None, "control may be silent"),
        (_P.WORKER, _F.KILL): Expected(GOES_ON, None, _REPLACED, is_replaced=True),
        (_P.WORKER, _F.STOP): Expected(GOES_ON, None, "the guard does not need it"),
        (_P.WORKER, _F.SPIN): Expected(GOES_ON, None, "the guard does not need it"),
        (_P.WORKER, _F.TERMINATE): Expected(GOES_ON, None, _UNAWARE),
        (_P.WORKER, _F.EXCEPTION): Expected(GOES_ON, None, _REPLACED, is_replaced=True),
        (_P.WORKER, _F.HALF_WORD): Expected(GOES_ON, None, "the guard does not need it"),
        (_P.WORKER, _F.FULL_PIPE): Expected(GOES_ON, None, "the guard does not need it"),
        (_P.WORKER, _F.MEMORY): Expected(GOES_ON, None, _REPLACED),
        (_P.RECORDER, _F.KILL): Expected(GOES_ON, None, _REPLACED, is_replaced=True),
        (_P.RECORDER, _F.STOP): Expected(GOES_ON, None, "ticks wait in the ring"),
        (_P.RECORDER, _F.SPIN): Expected(GOES_ON, None, "ticks wait in the ring"),
        (_P.RECORDER, _F.TERMINATE): Expected(GOES_ON, None, _UNAWARE),
        (_P.RECORDER, _F.EXCEPTION): Expected(GOES_ON, None, _REPLACED, is_replaced=True),
        (_P.RECORDER, _F.HALF_WORD): Expected(GOES_ON, None, "ticks wait in the ring"),
        (_P.RECORDER, _F.MEMORY): Expected(GOES_ON, None, _REPLACED),
        (_P.RECORDER, _F.DISK): Expected(GOES_ON, None, "the operator is told that the recording ends here"),
        (_P.CONSOLE, _F.KILL): Expected(GOES_ON, None, _REPLACED, is_replaced=True),
        (_P.CONSOLE, _F.STOP): Expected(GOES_ON, None, _REPLACED, is_replaced=True),
        (_P.CONSOLE, _F.SPIN): Expected(GOES_ON, None, "it shares no processor time with the guard"),
        (_P.CONSOLE, _F.TERMINATE): Expected(GOES_ON, None, _UNAWARE),
        (_P.CONSOLE, _F.EXCEPTION): Expected(GOES_ON, None, "an error of one request ends no other process"),
        (_P.CONSOLE, _F.HALF_MESSAGE): Expected(GOES_ON, None, "the parent checks each request", is_replaced=True),
        (_P.CONSOLE, _F.MEMORY): Expected(GOES_ON, None, "it is replaced if it ends"),
        (_P.LSL, _F.KILL): Expected(GOES_ON, None, _REPLACED, is_replaced=True),
        (_P.LSL, _F.STOP): Expected(GOES_ON, None, _REPLACED, is_replaced=True),
        (_P.LSL, _F.SPIN): Expected(GOES_ON, None, _REPLACED, is_replaced=True),
        (_P.LSL, _F.TERMINATE): Expected(GOES_ON, None, _UNAWARE),
        (_P.LSL, _F.EXCEPTION): Expected(GOES_ON, None, _REPLACED, is_replaced=True),
        (_P.LSL, _F.HALF_WORD): Expected(GOES_ON, None, "the parent never waits for the rest of a word"),
        (_P.LSL, _F.FULL_PIPE): Expected(GOES_ON, None, "the parent reads a limited amount at a time"),
        (_P.LSL, _F.MEMORY): Expected(GOES_ON, None, "it is replaced if it ends"),
        (_P.ROS2, _F.KILL): Expected(GOES_ON, None, "its loss is told once", told=_GONE),
        (_P.ROS2, _F.STOP): Expected(GOES_ON, None, "its loss is told once", told=_GONE),
        (_P.ROS2, _F.SPIN): Expected(GOES_ON, None, "its loss is told once", told=_GONE),
        (_P.ROS2, _F.TERMINATE): Expected(GOES_ON, None, _UNAWARE),
        (_P.ROS2, _F.EXCEPTION): Expected(GOES_ON, None, "its loss is told once", told=_GONE),
        (_P.ROS2, _F.HALF_WORD): Expected(GOES_ON, None, "the parent never waits for the rest of a word", told=_GONE),
        (_P.ROS2, _F.FULL_PIPE): Expected(GOES_ON, None, "the parent reads a limited amount at a time"),
        (_P.ROS2, _F.MEMORY): Expected(GOES_ON, None, "its loss is told if it ends"),
        (_P.PARENT, _F.KILL): Expected(LOWERED, PARENT_MS, "the guard sees that the parent is gone", (-9,)),
        (_P.PARENT, _F.STOP): Expected(LOWERED, SILENT_MS, _SILENT, None),
        (_P.PARENT, _F.SPIN): Expected(LOWERED, SILENT_MS, _SILENT, None),
        (_P.PARENT, _F.TERMINATE): Expected(LOWERED, PARENT_MS, "SIGTERM acts like Ctrl-C", (0, 143)),
        (_P.PARENT, _F.EXCEPTION): Expected(LOWERED, PARENT_MS, "the parent asks before it kills", (1,)),
        (_P.PARENT, _F.HALF_WORD): Expected(
            GOES_ON, None, "the parent never waits for the rest of a word, and cannot read the report then", (1,)
        ),
        (_P.PARENT, _F.HALF_MESSAGE): Expected(LOWERED, PARENT_MS, "the parent asks before it kills", (1,)),
        (_P.PARENT, _F.FULL_PIPE): Expected(LOWERED, SILENT_MS, _SILENT, None),
        (_P.PARENT, _F.MEMORY): Expected(EITHER, None, "a parent without memory may end the session", None),
        (_P.SESSION, _F.HANGUP): Expected(LOWERED, PARENT_MS, "a closed terminal acts like Ctrl-C", (0, 129)),
        (_P.SESSION, _F.QUIT): Expected(LOWERED, PARENT_MS, "the guard outlives Ctrl-\\", (-3, 0, 131)),
        (_P.SESSION, _F.CTRL_Z): Expected(EITHER, SILENT_MS, "the guard outlives Ctrl-Z", None),
        (_P.SESSION, _F.SUSPEND): Expected(BRAKED, DRIVES_MS, "no command reaches the drives", None),
    }
)
"""Expected reaction by process and fault. In a descent, `LOWERED` and `GOES_ON` both mean that the descent goes on."""

IN_PYTHON: Mapping[tuple[Process, Fault], Expected] = MappingProxyType(
    {
        (_P.GUARD, _F.SPIN): Expected(BRAKED, DRIVES_MS, "the loop itself spins, so no command is sent", None),
        (_P.GUARD, _F.HALF_WORD): Expected(EITHER, PARENT_MS, "anything in the pipe ends the run", None),
        (_P.GUARD, _F.FULL_PIPE): Expected(
            (Outcome.BRAKED, Outcome.LOWERED), SILENT_MS, "a message of the loop itself waits for the parent", None
        ),
    }
)
"""Reactions of the loop in Python that differ: it has no supervisor beside it."""

NOT_POSSIBLE: Mapping[Fault, str] = MappingProxyType(
    {
        Fault.HALF_WORD: "its parent sends it nothing by a pipe, and it sends nothing by one",
        Fault.HALF_MESSAGE: "no ring of messages in shared memory leads to this process",
        Fault.FULL_PIPE: "this process sends nothing to its parent while the loop runs",
        Fault.DISK: "only the recorder writes data of the run to the disk while the loop runs",
        Fault.HANGUP: "a terminal sends it to all processes: session:hup",
        Fault.QUIT: "a terminal sends it to all processes: session:quit",
        Fault.CTRL_Z: "a terminal sends it to all processes: session:ctrl-z",
        Fault.SUSPEND: "a computer suspends all processes: session:suspend",
    }
)
"""Reason why most processes cannot have this fault."""

OF_ONE_PROCESS = "this fault is one of a single process; the matrix strikes each process by itself"
"""Reason why a whole session cannot have a fault."""


def expected_of(cell: Cell) -> Expected:
    """Return the expected reaction of a cell that can be flown."""
    pair = cell.process, cell.fault
    return IN_PYTHON.get(pair, EXPECTED[pair]) if cell.loop is Loop.PYTHON else EXPECTED[pair]


def reason_absent(process: Process, fault: Fault) -> str:
    """Return the reason why this process cannot have this fault; empty if it can.

    Raises:
        KeyError: The table has neither an expectation nor a reason.
    """
    if (process, fault) in EXPECTED:
        return ""
    return OF_ONE_PROCESS if process is Process.SESSION else NOT_POSSIBLE[fault]


def needs_motion(cell: Cell) -> bool:
    """Return True if the session needs an identification motion: to be struck in it, or to have a worker."""
    return cell.state is State.MOVING or cell.process is Process.WORKER


def all_cells() -> list[Cell]:
    """Return all cells that can be flown, with those of the loop in Python."""
    in_c = [Cell(process, fault, state) for process, fault in EXPECTED for state in State]
    return [*in_c, *(replace(cell, loop=Loop.PYTHON) for cell in in_c if cell.process in OF_LOOP)]


OF_LOOP = (Process.GUARD, Process.CONTROL, Process.PARENT, Process.SESSION)
"""Processes whose faults the loop of the guard meets. The others are children of the same parent in both loops."""


def covering_cells() -> list[Cell]:
    """Return one cell for each pair of process and fault, with rotated states, in the loop in C."""
    states = {process: cycle(State) for process in Process}
    # A floating worker has nothing to do, and the flight to there takes half a minute.
    states[Process.WORKER] = cycle((State.MOVING, State.MOVING, State.DESCENDING))
    for number, process in enumerate(Process):
        for _ in range(number % len(State)):
            next(states[process])
    return [Cell(process, fault, next(states[process])) for process, fault in EXPECTED]


def python_cells() -> list[Cell]:
    """Return the covering cells of the processes whose faults the guard's loop meets, in the loop in Python."""
    return [replace(cell, loop=Loop.PYTHON) for cell in covering_cells() if cell.process in OF_LOOP]
