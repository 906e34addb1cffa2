"""Listener process for the streams of other devices, with a thread for each.

If liblsl hangs, floods or crashes, it does so here; the recorder only finds blocks in its ring.
"""

import threading
from dataclasses import dataclass
from multiprocessing.connection import Connection

from exograv.errors import ConfigError
from exograv.recording.messages import StreamNote
from exograv.runtime.processes.shared_memory import Ring

from .blocks import BLOCK, SAMPLES, SLOTS, block
from .quality import StreamQuality
from .stream_reader import StreamReader
from .streams import FoundStream, choose, formats


@dataclass(frozen=True)
class ListenerJob:
    """Start arguments of a listener."""

    ring: str
    """Name of the shared memory to the recorder."""

    wanted: tuple[str, ...]
    """Names or types of streams, for the first listener."""

    within_s: float
    """Time to find the streams [s]."""

    found: tuple[FoundStream, ...] = ()
    """Streams that the previous listener found before its process ended. They may have disappeared since then."""

    connections: tuple[int, ...] = ()
    """Number of connections so far, by stream."""


def listen(job: ListenerJob, parent: Connection) -> None:
    """Run the listener: find streams, report them, wait for the start message, record until the next message."""
    try:
        found = job.found or tuple(choose(job.wanted, job.within_s))
    except ConfigError as error:
        parent.send(error)
        return
    parent.send(found)
    line = _Line(parent, Ring(BLOCK, SLOTS, job.ring))
    readers = [
        StreamReader(stream, kind.topic, count, line.hand_of(number), line.note)
        for number, (stream, kind, count) in enumerate(
            zip(found, formats(found), job.connections or (0,) * len(found), strict=True)
        )
    ]
    over = threading.Event()
    threads = [threading.Thread(target=reader.run, args=(over,), daemon=True) for reader in readers]
    if not _heard(parent):
        return
    for thread in threads:
        thread.start()
    while not parent.poll(ALIVE_EVERY_S):
        line.note(ALIVE)
    over.set()
    for thread in threads:
        thread.join(END_MAX_S)
    line.note(None)


ALIVE, ALIVE_EVERY_S = "alive", 0.5
"""Sign of life to the parent, and the time between two [s]."""

END_MAX_S = 3.0
"""Time for a thread that waits for its device [s]."""

KEPT_FOR_CORRECTIONS = 16
"""Slots of the ring that samples leave free."""


class _Line:
    """Connection to the recorder and to the parent, for all threads."""

    def __init__(self, parent: Connection, ring: Ring):
        self._parent, self._ring, self._lock = parent, ring, threading.Lock()

    def hand_of(self, stream: int):
        """Return the `Hand` of a stream."""

        def hand(kind: int, monotonic: float, data: bytes) -> bool:
            with self._lock:
                if self._ring.room <= (KEPT_FOR_CORRECTIONS if kind == SAMPLES else 0):
                    return False
                return self._ring.put(block(stream, kind, monotonic, data))

        return hand

    def note(self, message: StreamNote | StreamQuality | str | None) -> None:
        """Send a message to the parent; None is the last one."""
        with self._lock:
            self._parent.send(message)


def _heard(parent: Connection) -> bool:
    """Wait for a message; return False if the parent is gone."""
    try:
        parent.recv()
    except (EOFError, OSError):
        return False
    return True
