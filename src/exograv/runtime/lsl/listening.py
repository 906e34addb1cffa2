"""Parent's side of other devices: starts the listener, replaces it when it dies, and records events of the streams."""

import time
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

from exograv.errors import ConfigError, RigError
from exograv.recording.messages import StreamNote
from exograv.recording.stream_block import packed_size
from exograv.results import json_value
from exograv.runtime.processes.shared_memory import Ring
from exograv.runtime.processes.supervisor import EXIT_S, Supervisor

from .blocks import BLOCK, DATA_BYTES, SLOTS, RecordedDevices
from .library import require_lsl
from .listener import ALIVE, END_MAX_S, ListenerJob, listen
from .quality import StreamCondition, StreamQuality
from .streams import FoundStream, formats

FIND_S = 10.0
"""Time to find the requested streams [s]."""

START_MAX_S = 30.0
"""Additional time for a fresh interpreter on a slow computer [s]."""

HANGS_S = 5.0
"""Time without a sign of life after which a listener hangs, and is replaced [s]."""

RESTARTS_MAX = 3
"""Largest number of replaced listeners; a cause that ends so many would end the next one too."""

Record = Callable[[str, float, Mapping[str, Any]], object]


@dataclass(frozen=True)
class ListenedStream:
    """Figures of one recorded stream of another device."""

    name: str
    type: str
    topic: str
    connected: int
    lost: int
    silent: int


@dataclass(frozen=True)
class StreamState:
    """State of one stream during a run."""

    name: str
    type: str
    nominal_rate_Hz: float
    """Rate in the stream's own description [1/s]; 0 for a stream without one."""
    condition: StreamCondition
    quality: StreamQuality | None
    """Quality of the present connection; None before its first report."""


CONDITIONS = {
    "connected": StreamCondition.RECORDED,
    "resumed": StreamCondition.RECORDED,
    "silent": StreamCondition.SILENT,
    "lost": StreamCondition.LOST,
}
"""Conditions of a stream, by the kind of the last message of `/stream`."""


class Listening:
    """Listener of a run; it records from `begin` to `finish`. `with Listening(...) as listening:`."""

    def __init__(self, wanted: Sequence[str], within_s: float = FIND_S):
        """Find the streams; nothing is recorded yet.

        Args:
            wanted: Names of streams, or types; a type means all streams of it.
            within_s: Time to find them.

        Raises:
            ConfigError: A stream is not there or cannot be recorded, or LSL is not installed.
            RigError: The listener died.
        """
        require_lsl()
        self._ring = Ring(BLOCK, SLOTS)
        self._job = ListenerJob(self._ring.name, tuple(wanted), within_s)
        self._connections, self._record = Counter[str](), None
        self._notes = Counter[str]()
        self._conditions, self._qualities = dict[str, StreamCondition](), dict[str, StreamQuality]()
        self._heard_s = self._checked_s = 0.0
        self._patience_s, self._has_given_up = START_MAX_S, False
        self._child = Supervisor("listener", listen, self._job, RESTARTS_MAX)
        try:
            self.found: tuple[FoundStream, ...] = self._found(within_s + START_MAX_S)
        except BaseException:
            self.close()
            raise
        self.devices = RecordedDevices(self._ring.name, formats(self.found))

    @property
    def pid(self) -> int:
        """Process identifier of the listener."""
        return self._child.pid

    @property
    def restarts(self) -> int:
        """Number of listeners that were replaced."""
        return self._child.restarts

    def begin(self, record: Record) -> None:
        """Record from now on; the function `record` receives the messages of `/stream`."""
        self._record, self._heard_s, self._patience_s = record, time.monotonic(), START_MAX_S
        self._child.send("begin")  # if the listener has died, `check` starts another

    def check(self) -> None:
        """Pass on new messages, and replace a listener that has died or hangs. Call it several times per second."""
        self._hear()
        if self._record is None or self._has_given_up:
            return
        if self._child.is_alive and self._hangs():
            self._child.kill()
            self._child.await_exit(EXIT_S)
        if not self._child.is_alive:
            connections = tuple(self._connections[one.topic] for one in self.devices.streams)
            if self._child.replace(replace(self._job, found=self.found, connections=connections)):
                self.begin(self._record)
            else:
                self._give_up()

    def finish(self) -> None:
        """Have the last samples handed over, before the recorder completes its file."""
        if self._record is None:
            return
        self._child.send("over")
        until = time.monotonic() + END_MAX_S + 1.0
        while self._child.is_alive and time.monotonic() < until and not self._hear():
            self._child.await_exit(0.02)
        self._hear()
        self._record = None

    def figures(self) -> list[ListenedStream]:
        """Count connections, losses and silences of each stream."""
        return [
            ListenedStream(
                stream.name,
                stream.type,
                kind.topic,
                *(self._notes[f"{kind.topic} {what}"] for what in ("connected", "lost", "silent")),
            )
            for stream, kind in zip(self.found, self.devices.streams, strict=True)
        ]

    def states(self) -> tuple[StreamState, ...]:
        """Return condition and quality of each stream as last reported."""
        return tuple(
            StreamState(
                stream.name,
                stream.type,
                stream.rate_Hz,
                self._conditions.get(kind.topic, StreamCondition.AWAITED),
                self._qualities.get(kind.topic),
            )
            for stream, kind in zip(self.found, self.devices.streams, strict=True)
        )

    def close(self) -> None:
        """End the listener and release the shared memory."""
        self.finish()
        self._child.end(0.5)
        self._ring.close()

    def __enter__(self) -> "Listening":
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _hangs(self) -> bool:
        now = time.monotonic()
        if now - self._checked_s > 0.5 * HANGS_S:
            self._heard_s = now  # the first look, or this process stood still, not the listener
        self._checked_s = now
        return now - self._heard_s > self._patience_s

    def _give_up(self) -> None:
        """Note once that the streams are lost for the rest of the run."""
        self._has_given_up, text = True, f"The listener has ended {RESTARTS_MAX + 1} times, and is not replaced again."
        for one in self.devices.streams:
            self._take(StreamNote(time.monotonic(), one.topic, "lost", text, self._connections[one.topic]))

    def _found(self, within_s: float) -> tuple[FoundStream, ...]:
        word = self._child.next_word(within_s)
        if word is None:
            raise RigError("The listener for streams of LSL did not start. Its output above gives the reason.")
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
        """Pass on new messages; return True after the last one."""
        for word in self._child.heard():
            if word == ALIVE:  # The threads of the streams may go on beside a main thread that hangs.
                self._heard_s, self._patience_s = time.monotonic(), HANGS_S
            elif word is None:
                return True
            elif isinstance(word, StreamNote):
                self._take(word)
            elif isinstance(word, StreamQuality):
                self._qualities[word.topic] = word
        return False

    def _take(self, note: StreamNote) -> None:
        if self._record is not None:
            self._connections[note.topic] = note.connection
            self._notes[f"{note.topic} {note.kind}"] += 1
            if note.kind in CONDITIONS:
                self._conditions[note.topic] = CONDITIONS[note.kind]
            if note.kind == "connected":
                self._qualities.pop(note.topic, None)
            self._record("/stream", 0.0, json_value(note))
