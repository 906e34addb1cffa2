"""The parent's side of other devices: a listener, and another when it dies; what becomes of their streams is noted."""

import contextlib
import time
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import Any

from exograv.errors import ConfigError, RigError
from exograv.recording.stream_block import packed_size
from exograv.runtime.processes.shared_memory import Ring
from exograv.runtime.processes.spawn import spawned

from .blocks import BLOCK, DATA_BYTES, SLOTS, RecordedDevices
from .library import require_lsl
from .listener import END_MAX_S, ListenerJob, listen
from .streams import FoundStream, formats

FIND_S = 10.0
"""For the streams that were asked for."""

START_MAX_S = 30.0
"""Beside it, for a fresh interpreter on a slow computer."""

RESTARTS_MAX = 3
"""Listeners that are replaced; what ends so many would end the next one too."""

Record = Callable[[str, float, Mapping[str, Any]], object]


class Listening:
    """Finds the streams, and records them from `begin` to `finish`. `with Listening(...) as listening:`."""

    def __init__(self, wanted: Sequence[str], within_s: float = FIND_S):
        """Find them; nothing is recorded yet.

        Args:
            wanted: Names of streams; or types, all of which are meant then.
            within_s: For them to be found.

        Raises:
            ConfigError: One is not there, or cannot be recorded, or LSL is not installed.
            RigError: The listener died.
        """
        require_lsl()
        self._ring = Ring(BLOCK, SLOTS)
        self._job = ListenerJob(self._ring.name, tuple(wanted), within_s)
        self._connections, self._record, self.restarts = Counter[str](), None, 0
        self._notes = Counter[str]()
        self._start()
        try:
            self.found: tuple[FoundStream, ...] = self._found(within_s + START_MAX_S)
        except BaseException:
            self.close()
            raise
        self.devices = RecordedDevices(self._ring.name, formats(self.found))

    @property
    def pid(self) -> int:
        """Of the listener."""
        return self._process.pid or 0

    def begin(self, record: Record) -> None:
        """Record from now on; `record` takes the messages of `/stream`."""
        self._record = record
        with contextlib.suppress(OSError):  # it has died; `check` starts another
            self._line.send("begin")

    def check(self) -> None:
        """Pass on what is new, and start another listener if this one has died. To be called some times a second."""
        self._hear()
        if self._record is not None and not self._process.is_alive() and self.restarts < RESTARTS_MAX:
            self.restarts += 1
            self._line.close()
            connections = tuple(self._connections[one.topic] for one in self.devices.streams)
            self._job = replace(self._job, found=self.found, connections=connections)
            self._start()
            self.begin(self._record)

    def finish(self) -> None:
        """Have the last samples handed over; before the recorder completes its file."""
        if self._record is None:
            return
        with contextlib.suppress(OSError):
            self._line.send("over")
        until = time.monotonic() + END_MAX_S + 1.0
        while self._process.is_alive() and time.monotonic() < until and not self._hear():
            self._process.join(0.02)
        self._hear()
        self._record = None

    def figures(self) -> list[dict[str, Any]]:
        """What was connected and lost, by stream."""
        return [
            {
                "name": stream.name,
                "type": stream.kind,
                "topic": kind.topic,
                **{what: self._notes[f"{kind.topic} {what}"] for what in ("connected", "lost", "silent")},
            }
            for stream, kind in zip(self.found, self.devices.streams, strict=True)
        ]

    def close(self) -> None:
        """End it, and let go of the memory."""
        self.finish()
        self._line.close()
        self._process.join(0.5)
        if self._process.is_alive():
            self._process.kill()
            self._process.join(1.0)
        self._ring.close()

    def __enter__(self) -> "Listening":
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _start(self) -> None:
        self._process, self._line = spawned("listener", listen, self._job)

    def _found(self, within_s: float) -> tuple[FoundStream, ...]:
        try:
            word = self._line.recv() if self._line.poll(within_s) else None
        except EOFError:
            word = None
        if word is None:
            raise RigError("The listener for streams of LSL did not begin. What it wrote above says why.")
        if isinstance(word, ConfigError):
            raise word
        for stream in word:
            if packed_size(1, stream.channels, 8) > DATA_BYTES:
                raise ConfigError(
                    f"The stream {stream.name} has {stream.channels} channels; allowed are {DATA_BYTES // 8 - 5}. "
                    "Send it as several streams."
                )
        return word

    def _hear(self) -> bool:
        """Whether the listener has said its last word."""
        try:
            while self._line.poll():
                word = self._line.recv()
                if word is None:
                    return True
                if isinstance(word, dict) and self._record is not None:
                    self._connections[word["topic"]] = word["connection"]
                    self._notes[f"{word['topic']} {word['kind']}"] += 1
                    self._record("/stream", 0.0, word)
        except (EOFError, OSError):
            pass  # it has died
        return False
