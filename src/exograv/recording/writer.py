"""Writer of a recording during the run; a killed writer loses at most the last chunk, and the file can be continued."""

import contextlib
import json
import os
from collections import deque
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from types import TracebackType
from typing import Any, BinaryIO

import numpy as np
from mcap.opcode import Opcode
from mcap.records import Schema

from exograv.errors import RecordingError

from .container import INDEX_ENTRY, MESSAGE_HEAD, RECORD_HEAD, ChunkedFile
from .contents import FileHead, crc_of, end_of_kept, examine
from .encoding import json_schema, misfits, stored, tick_definition
from .file_content import read_content
from .interrupt import uninterrupted
from .output_file import opened, sync_folder, unwritable
from .reader import settings_of
from .schema import CHANNELS, PACKED_VERSION, SCHEMA_VERSION, TICK
from .stream_block import StreamFormat
from .tick_block import T_MAX_S, TickBlock
from .tick_columns import COLUMNS_ENCODING, COLUMNS_SCHEMA, COLUMNS_TOPIC, VIEWED_EVERY, pack
from .tick_row import TickRow, tick_row

CHUNK_BYTES = 1_000_000
"""Size of a chunk for compression, about five seconds of ticks; an abrupt end loses no more."""

SYNC_EVERY_S = 0.2
"""Time between two syncs of a live recording [s].

A power failure may cost 250 ms (docs/explanation/safety.md, F20), and the sync takes a part of them.
"""

AT_ONCE = frozenset({"/settings", "/event", "/result", "/timing"})
"""Topics whose messages are with the operating system when `write` returns: they matter most after a crash."""


BEGUN: deque[Path] = deque(maxlen=1)
"""Path of the recording that this process began last. An interrupted command names it."""


class RecordingWriter:
    """Recording in progress. `with RecordingWriter(...) as recording:` completes the file after any error inside.

    The file holds no wall-clock time: the same seed gives the same messages, except for `tick_us`, `lateness_us` and
    `monotonic`.
    """

    def __init__(
        self,
        path: Path,
        joints: Sequence[str],
        settings: Mapping[str, Any],
        streams: Sequence[StreamFormat] = (),
        packed: bool = False,
    ):
        """Create the file and write its settings.

        Args:
            path: File to create, or to replace; its folder is created too.
            joints: Actuated joints, in the order of every per-joint array.
            settings: Message of `/settings`, without `schema_version` and `joints`.
            streams: Streams of other devices to record too.
            packed: True to pack the ticks by column, in half of the space. Viewers then see every tenth tick.

        Raises:
            RecordingError: The file cannot be created, or the settings have a name that the format does not know.
        """
        version = PACKED_VERSION if packed else SCHEMA_VERSION
        head = encoded("/settings", 0.0, {"schema_version": version, "joints": list(joints), **settings})
        self._take(Path(path), opened(Path(path), "wb"))
        with self._writing():
            self._file.begin()
            for topic in CHANNELS:
                self._file.add_channel(*_channel(topic, len(joints)))
            if packed:
                self._file.add_channel(
                    COLUMNS_TOPIC, COLUMNS_ENCODING, Schema(len(CHANNELS) + 1, b"", "", COLUMNS_SCHEMA)
                )
            for number, stream in enumerate(streams, start=len(CHANNELS) + 1 + packed):
                schema = Schema(number, stream.definition.encode(), "ros2msg", stream.schema_name)
                self._file.add_channel(stream.topic, "cdr", schema)
        self._prepare(len(joints))
        self._add("/settings", 0.0, head)

    @classmethod
    def continued(cls, path: Path, ticks_safe: int = 0, kept: Mapping[str, int] | None = None) -> "RecordingWriter":
        """Continue a file whose writer was stopped at any point; the part after its last complete chunk is cut off.

        Args:
            path: The file.
            ticks_safe: Ticks that a sync has promised; the file is not cut if it holds fewer.
            kept: Number of messages to keep, by topic. A chunk with a later one is cut off, with what follows it.

        Raises:
            RecordingError: The file is missing, of another version, holds fewer ticks, or the disk fails.
        """
        self, path = cls.__new__(cls), Path(path)
        heads = list[bytes]()
        with read_content(path) as content:
            whole = content if not kept else FileHead(content, end_of_kept(content, kept))
            found = examine(whole, lambda topic, data: heads.append(data) if topic == "/settings" else None)
            crc = crc_of(content, found.good)
        settings = settings_of(path, heads)
        version = PACKED_VERSION if COLUMNS_TOPIC in found.topics.values() else SCHEMA_VERSION
        if settings["schema_version"] != version or list(found.topics.values())[: len(CHANNELS)] != list(CHANNELS):
            raise RecordingError(f"{path} is of another version of exograv and cannot be continued. Start a new one.")
        self._take(path, opened(path, "r+b"))
        self._file.schemas, self._file.channels, self._file.chunks = found.schemas, found.channels, found.chunks
        self._file.counts = found.counts
        self._prepare(len(settings["joints"]))
        self._n_ticks = found.ticks
        self._ticks.phase = self.count("/phase")
        if (ticks := self.count(TICK.topic)) < ticks_safe:
            self._stream.close()
            raise RecordingError(
                f"{path} holds {ticks} sound ticks, and {ticks_safe} were on the disk before: the disk or another "
                "program has altered it. It is left as it is; record into another file."
            )
        with self._writing():
            self._stream.truncate(found.good)
            self._file.resume(crc, found.good)
        return self

    def tick(self, t: float, **values: Any) -> None:
        """Record one period, with the values of the `/tick` table except `t` and `phase` by name; some have defaults.

        Raises:
            RecordingError: The disk is full or gone.
            ValueError: A value is missing or unknown.
        """
        self.tick_row(tick_row({"t": t, **values}, self._n_joints))

    def tick_row(self, row: TickRow) -> None:
        """Record one period; in a loop this is five times as fast as `tick`.

        Raises:
            RecordingError: The disk is full or gone.
            ValueError: An array is not of float64, or has another number of joints.
        """
        self._ticks.add(row)
        if self._ticks.is_full:
            self._flush()

    def next_row(self) -> int:
        """Address of the next row of 64-bit numbers: the fields of `TickRow`, with the phase before the arrays.

        Native code writes the row there, and `end_row` records it. This replaces a `tick_row`.
        """
        return self._ticks.next_row()

    def end_row(self) -> None:
        """Record the row that was written at `next_row`.

        Raises:
            RecordingError: The disk is full or gone.
        """
        self._ticks.end_row()
        if self._ticks.is_full:
            self._flush()

    @property
    def phase_number(self) -> int:
        """Number of the phase that the next ticks belong to."""
        return self._ticks.phase

    def ticks(self, rows: np.ndarray) -> None:
        """Record packed ticks (tick,) of `encoding.tick_dtype`, each with its own `phase`.

        Raises:
            RecordingError: The disk is full or gone.
        """
        while len(rows):
            rows = rows[self._ticks.add_rows(rows) :]
            if self._ticks.is_full:
                self._flush()

    def phase(self, t: float, name: str) -> None:
        """Begin a phase of the session at `t`; the ticks that follow belong to it."""
        self.write("/phase", t, {"name": name})
        self._ticks.phase += 1

    def write(self, topic: str, t: float, message: Mapping[str, Any]) -> None:
        """Record a message of a JSON channel; `t` [s] is added if the channel has this field.

        Raises:
            RecordingError: The message does not fit the channel, or the disk is full or gone.
        """
        self._add(topic, t, encoded(topic, t, message))

    def write_block(self, topic: str, t: float, data: bytes) -> None:
        """Record samples of another device, in the form of `stream_block.packed`.

        Raises:
            RecordingError: The disk is full or gone.
        """
        self._add(topic, t, data)

    def count(self, topic: str) -> int:
        """Return the number of messages so far, with those from before the file was continued."""
        if topic == TICK.topic:
            return self._n_ticks + len(self._ticks)
        channel = self._ids[topic]
        return self._file.counts.get(channel, 0) + len(self._entries.get(channel, ()))

    @property
    def t_last(self) -> float:
        """Latest time in the file [s], without buffered messages; 0 in an empty file."""
        return 1e-9 * self._file.chunks.time_span_ns[1]

    def sync(self) -> int:
        """Force all data to the disk, where they survive a power failure, and return how many ticks are safe there.

        Raises:
            RecordingError: The disk is full, gone or failing. The recording ends there, and stays readable to its last
                complete chunk. A failed sync is never repeated.
        """
        self._flush()
        with self._writing():
            # After a failed fsync the kernel marks the lost pages as clean, so a second fsync would wrongly succeed.
            # Source: Rebello et al. 2020, Can applications recover from fsync failures?, USENIX ATC.
            os.fdatasync(self._stream.fileno())
            if not self._is_named:
                sync_folder(self.path)
                self._is_named = True
        return self.count(TICK.topic)

    def close(self) -> None:
        """Complete the file and force it to the disk; do nothing the second time, or after the disk failed."""
        if self._stream.closed:
            return
        self._flush()
        with uninterrupted(), self._writing():
            self._file.finish()
            os.fdatasync(self._stream.fileno())
            self._stream.close()

    def __enter__(self) -> "RecordingWriter":
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def _take(self, path: Path, stream: BinaryIO) -> None:
        self.path, self._stream = path, stream
        BEGUN.append(path)
        self._is_named = False  # True if a sync has put the file's name into its folder on the disk
        self._failure: str | None = None
        self._file = ChunkedFile(stream)

    def _prepare(self, n_joints: int) -> None:
        self._ids = {channel.topic: channel.id for channel in self._file.channels}
        self._n_joints = n_joints
        self._ticks = TickBlock(self._ids[TICK.topic], n_joints, CHUNK_BYTES)
        self._n_ticks = 0  # in the file
        self._messages = bytearray()
        self._entries: dict[int, list[tuple[int, int]]] = {}

    def _add(self, topic: str, t: float, data: bytes) -> None:
        self._append(topic, t, data)
        if topic in AT_ONCE or len(self._messages) > CHUNK_BYTES:
            self._flush()

    def _append(self, topic: str, t: float, data: bytes) -> None:
        channel, time_ns = self._ids[topic], round(1e9 * t) if 0.0 <= t < T_MAX_S else 0
        self._entries.setdefault(channel, []).append((time_ns, len(self._messages)))
        head = RECORD_HEAD.pack(Opcode.MESSAGE, MESSAGE_HEAD.size + len(data))
        self._messages += head + MESSAGE_HEAD.pack(channel, 0, time_ns, time_ns) + data

    def _flush(self) -> None:
        """Write all messages and ticks so far as one chunk, messages first; a viewer sorts by time."""
        # An interrupt between chunk and index would leave a chunk that the file's index does not name.
        with uninterrupted():
            self._write_chunk()

    def _write_chunk(self) -> None:
        n_ticks, every = len(self._ticks), 1
        if n_ticks and COLUMNS_TOPIC in self._ids:
            every = VIEWED_EVERY
            self._append(COLUMNS_TOPIC, float(self._ticks.ticks["t"][0]), pack(self._ticks.ticks))
        index = {channel: np.array(entries, INDEX_ENTRY) for channel, entries in self._entries.items()}
        ticks, entries = self._ticks.take(len(self._messages), every)
        if len(entries):
            index[self._ids[TICK.topic]] = entries
        messages = bytes(self._messages) + ticks
        self._messages.clear()
        self._entries.clear()
        if index:
            with self._writing():
                self._file.add_chunk(messages, index)
            self._n_ticks += n_ticks

    @contextlib.contextmanager
    def _writing(self) -> Iterator[None]:
        if self._failure:
            raise RecordingError(self._failure)
        try:
            yield
        except OSError as error:
            self._failure = unwritable(self.path, error)
            with contextlib.suppress(OSError):  # the rest of its buffer fails again
                self._stream.close()
            raise RecordingError(self._failure) from error


def encoded(topic: str, t: float, message: Mapping[str, Any]) -> bytes:
    """Return a message of a JSON channel as it is stored; `t` [s] is added if the channel has this field.

    Raises:
        RecordingError: There is no such channel, or the message does not fit it.
    """
    if topic not in CHANNELS:
        raise RecordingError(f"The recording format has no channel {topic}. Allowed: {', '.join(CHANNELS)}.")
    channel = CHANNELS[topic]
    if channel.fields[0].name == "t":
        message = {"t": t, **message}
    if wrong := misfits(channel, message):
        raise RecordingError(
            f"A message of {topic} does not fit the recording format: {', '.join(wrong)}. "
            f"Allowed: {', '.join(field.name for field in channel.fields)}."
        )
    try:
        return json.dumps(stored(channel.fields, message), allow_nan=False, default=_plain, ensure_ascii=False).encode()
    except (TypeError, ValueError) as error:
        raise RecordingError(f"A message of {topic} at {t} s is no JSON: {error}. Use null for 'none'.") from error


def _channel(topic: str, n_joints: int) -> tuple[str, str, Schema]:
    channel, number = CHANNELS[topic], list(CHANNELS).index(topic) + 1
    if channel.encoding == "cdr":
        language, definition = "ros2msg", tick_definition(n_joints)
    else:
        language, definition = "jsonschema", json.dumps(json_schema(channel.fields, n_joints), ensure_ascii=False)
    schema = Schema(id=number, name=channel.schema_name, encoding=language, data=definition.encode())
    return topic, channel.encoding, schema


def _plain(value: Any) -> Any:
    if isinstance(value, np.ndarray | np.generic):
        return value.tolist()
    raise TypeError(f"{type(value).__name__} has no form in JSON")
