"""Cell of the matrix: one process, one fault and one state; and the instructions for one flight, in a file."""

import enum
import json
from dataclasses import asdict, dataclass
from pathlib import Path

from exograv.errors import ConfigError

ORDERS = "EXOGRAV_PROCESS_FAULT"
"""Environment variable with the file of `FlightOrders`. It also marks every process of the session."""


class Process(enum.StrEnum):
    """Process that is struck."""

    GUARD = "guard"
    CONTROL = "control"
    WORKER = "worker"
    RECORDER = "recorder"
    PARENT = "parent"
    SESSION = "session"
    """All processes at once, as a terminal or a suspended computer does."""
    CONSOLE = "console"
    LSL = "lsl"
    ROS2 = "ros2"


class Fault(enum.StrEnum):
    """Fault of a process."""

    KILL = "kill"
    STOP = "stop"
    SPIN = "spin"
    HANGUP = "hup"
    TERMINATE = "term"
    QUIT = "quit"
    EXCEPTION = "exception"
    HALF_WORD = "half-word"
    HALF_MESSAGE = "half-message"
    """The memory of the messages to this process holds a message that is not whole."""
    FULL_PIPE = "full-pipe"
    MEMORY = "memory"
    DISK = "disk"
    CTRL_Z = "ctrl-z"
    SUSPEND = "suspend"


class Loop(enum.StrEnum):
    """Loop of the guard in which the machine is flown."""

    C = "c"
    """The loop in C, for drives on `udp`."""
    PYTHON = "python"
    """The loop in Python, as for the twin, CANopen, moteus and a session that pages steer."""


class State(enum.StrEnum):
    """State of the session at the strike."""

    FLOATING = "floating"
    MOVING = "moving"
    DESCENDING = "descending"


@dataclass(frozen=True)
class Cell:
    """Cell of the matrix: process × fault × state, in one of the two loops of the guard."""

    process: Process
    fault: Fault
    state: State
    loop: Loop = Loop.C

    @property
    def name(self) -> str:
        """Name as in `--only`, such as control:kill:floating or control:kill:floating:python."""
        last = "" if self.loop is Loop.C else f":{self.loop}"
        return f"{self.process}:{self.fault}:{self.state}{last}"

    @classmethod
    def of(cls, name: str) -> "Cell":
        """Read a name.

        Raises:
            ConfigError: A part of the name does not exist.
        """
        parts = name.lower().split(":")
        kinds = (Process, Fault, State, Loop)
        parts += [Loop.C] * (len(parts) == len(kinds) - 1)
        for part, kind in zip([*parts, "", "", "", ""], kinds, strict=False):
            if part not in tuple(kind):
                allowed = ", ".join(kind)
                raise ConfigError(
                    f"--only is '{name}': there is no {kind.__name__.lower()} '{part}'. Give PROCESS:FAULT:STATE, such "
                    f"as control:kill:floating, and :python for the loop in Python; here allowed: {allowed}."
                )
        if len(parts) != len(kinds):
            raise ConfigError(f"--only is '{name}'; give PROCESS:FAULT:STATE or PROCESS:FAULT:STATE:python.")
        return cls(Process(parts[0]), Fault(parts[1]), State(parts[2]), Loop(parts[3]))


@dataclass(frozen=True)
class FlightOrders:
    """Instructions of one flight for the processes of its session: when to fail, and how."""

    cells: tuple[str, ...]
    """Names of the cells, in the order of their strikes."""
    folder: str
    """Folder in which the processes write their notes."""
    participant: str
    """File of the prepared participant."""
    drives: str
    """The file drives.toml of the simulated drives."""
    seconds: float
    """Duration of the loop [s]."""
    motion_s: float
    """Duration of an identification motion [s]; 0 for an arm that is known."""
    router: str = ""
    """Locator of the Zenoh router; empty without a bridge to ROS 2."""

    def write(self, path: Path) -> None:
        """Write the instructions to a file."""
        path.write_text(json.dumps(asdict(self)), encoding="utf-8")

    @classmethod
    def read(cls, path: Path) -> "FlightOrders":
        """Read the instructions of a flight from their file."""
        said = json.loads(path.read_text(encoding="utf-8"))
        return cls(**{**said, "cells": tuple(said["cells"])})

    @property
    def struck(self) -> list[Cell]:
        """Cells of the flight, in the order of their strikes."""
        return [Cell.of(name) for name in self.cells]

    @property
    def loop(self) -> Loop:
        """Loop of the guard, the same for all cells of a flight."""
        return self.struck[0].loop

    def has(self, process: Process) -> bool:
        """Return True if this process is struck in the flight."""
        return any(cell.process is process for cell in self.struck)
