"""Session of a flight, seen from outside: its process, its terminal, its notes, and what its recorder acknowledged."""

import contextlib
import os
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from .cell import ORDERS, Loop
from .notes import read_notes
from .watching import acknowledged_ticks, end_all, forget_memory, left_memory, memory_of, processes_of

LOOK_S = 0.02


@dataclass
class Session:
    """Session of a flight, seen from outside."""

    process: "subprocess.Popen[bytes]"
    orders: Path
    folder: Path
    output: list[bytes] = field(default_factory=list)
    may_read: threading.Event = field(default_factory=threading.Event)
    acknowledged: int = 0
    memory: set[str] = field(default_factory=set)
    """Names of all shared memory that was seen in its processes."""

    def read(self) -> None:
        """Read the terminal's output until its end; pause while `may_read` is not set."""
        assert self.process.stdout is not None
        while self.may_read.wait() and (data := os.read(self.process.stdout.fileno(), 65536)):
            self.output.append(data)

    def look(self) -> None:
        """Note the ticks that the recorder has acknowledged until now, then wait a little."""
        for note in self.notes("ring"):
            self.acknowledged = acknowledged_ticks(note["name"], self.acknowledged)
        time.sleep(LOOK_S)

    def look_at_memory(self) -> list[int]:
        """Note the shared memory of all present processes; return their identifiers."""
        pids = list(processes_of(self.orders))
        self.memory |= memory_of(pids)
        return pids

    def notes(self, kind: str) -> list[dict[str, Any]]:
        """Return the notes of one kind so far."""
        return [note for note in read_notes(self.folder) if note["kind"] == kind]

    @property
    def modes(self) -> list[str]:
        """Modes that the guard has announced so far."""
        return [str(note["name"]) for note in self.notes("mode")]

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


@contextlib.contextmanager
def struck_session(orders: Path, folder: Path, loop: Loop) -> Iterator[Session]:
    """Start the session of a flight; yield it, and end all its processes. An error also deletes their memory."""
    words = [sys.executable, "-m", f"{__package__}.session"]
    environment = {**os.environ, ORDERS: str(orders), "COLUMNS": "200", "EXOGRAV_LOOP": loop.value}
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
    except BaseException:
        session.look_at_memory()
        end_all(orders, 0.0)
        forget_memory(left_memory(session.memory))
        raise
    finally:
        end_all(orders, 0.0)
        process.wait()
        session.may_read.set()
        reader.join(2.0)
        assert process.stdout is not None
        process.stdout.close()
