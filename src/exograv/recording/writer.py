"""Writes a recording while the run goes on: what is killed loses at most the last chunk."""

import contextlib
import json
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from types import TracebackType
from typing import Any, BinaryIO

import numpy as np
from mcap.opcode import Opcode
from mcap.records import Schema

from exograv.errors import RecordingError

from .container import INDEX_ENTRY, MESSAGE_HEAD, RECORD_HEAD, ChunkedFile
from .encoding import json_schema, misfits, tick_definition
from .schema import CHANNELS, SCHEMA_VERSION
from .tick_block import TickBlock

CHUNK_BYTES = 1_000_000
"""What compression and an abrupt end work on: about five seconds of ticks."""

AT_ONCE = frozenset({"/settings", "/event", "/result"})
"""Messages that are on disk when `write` returns: after a crash they matter most."""


class RecordingWriter:
    """A recording being written. `with RecordingWriter(...) as recording:` completes the file, whatever happens inside.

    The file holds no wall-clock time: the same seed gives the same messages, but for `tick_us`.
    """

    def __init__(self, path: Path, joints: Sequence[str], settings: Mapping[str, Any]):
        """Create the file and write its settings.

        Args:
            path: File to create, or to replace; its folder is created too.
            joints: Actuated joints, in the order of every per-joint array.
            settings: Message of `/settings`, without `schema_version` and `joints`.

        Raises:
            RecordingError: The file cannot be created, or the settings hold a name that the format does not know.
        """
        self.path = Path(path)
        head = _encoded("/settings", 0.0, {"schema_version": SCHEMA_VERSION, "joints": list(joints), **settings})
        self._stream = _opened(self.path)
        with self._writing():
            self._file = ChunkedFile(self._stream)
            self._ids = {topic: self._file.add_channel(*_channel(topic, len(joints))) for topic in CHANNELS}
        self._ticks = TickBlock(self._ids["/tick"], len(joints), CHUNK_BYTES)
        self._messages = bytearray()
        self._entries: dict[int, list[tuple[int, int]]] = {}
        self._add("/settings", 0.0, head)

    def tick(self, t: float, **values: Any) -> None:
        """Record one period; every value of the `/tick` table but `t` and `phase`, by its name.

        Raises:
            RecordingError: The disk is full or gone.
            ValueError: A value is missing: it would silently keep that of another tick.
        """
        self._ticks.add(t, values)
        if self._ticks.is_full:
            self._flush()

    def phase(self, t: float, name: str) -> None:
        """Say what the session does from `t` on; the ticks that follow belong to it."""
        self.write("/phase", t, {"name": name})
        self._ticks.phase += 1

    def write(self, topic: str, t: float, message: Mapping[str, Any]) -> None:
        """Record a message of a JSON channel; `t` [s] is added to it where the channel has one.

        Raises:
            RecordingError: The message does not fit the channel, or the disk is full or gone.
        """
        self._add(topic, t, _encoded(topic, t, message))

    def close(self) -> None:
        """Complete the file; does nothing the second time."""
        if self._stream.closed:
            return
        self._flush()
        with self._writing():
            self._file.finish()
            self._stream.close()

    def __enter__(self) -> "RecordingWriter":
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def _add(self, topic: str, t: float, data: bytes) -> None:
        channel, time_ns = self._ids[topic], round(1e9 * t)
        self._entries.setdefault(channel, []).append((time_ns, len(self._messages)))
        head = RECORD_HEAD.pack(Opcode.MESSAGE, MESSAGE_HEAD.size + len(data))
        self._messages += head + MESSAGE_HEAD.pack(channel, 0, time_ns, time_ns) + data
        if topic in AT_ONCE or len(self._messages) > CHUNK_BYTES:
            self._flush()

    def _flush(self) -> None:
        """Everything so far becomes a chunk: messages, then ticks; a viewer sorts by time."""
        index = {channel: np.array(entries, INDEX_ENTRY) for channel, entries in self._entries.items()}
        ticks, entries = self._ticks.take(len(self._messages))
        if len(entries):
            index[self._ids["/tick"]] = entries
        messages = bytes(self._messages) + ticks
        self._messages.clear()
        self._entries.clear()
        if index:
            with self._writing():
                self._file.add_chunk(messages, index)

    @contextlib.contextmanager
    def _writing(self) -> Iterator[None]:
        try:
            yield
        except OSError as error:
            with contextlib.suppress(OSError):  # what is still in its buffer fails again
                self._stream.close()
            raise _unwritable(self.path, error) from error


def _opened(path: Path) -> BinaryIO:
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        return path.open("wb")
    except OSError as error:
        raise _unwritable(path, error) from error


def _unwritable(path: Path, error: OSError) -> RecordingError:
    return RecordingError(
        f"The recording {path} cannot be written: {error.strerror}. "
        "Free some space there, or give another folder with --out."
    )


def _encoded(topic: str, t: float, message: Mapping[str, Any]) -> bytes:
    channel = CHANNELS[topic]
    if channel.fields[0].name == "t":
        message = {"t": t, **message}
    if wrong := misfits(channel, message):
        raise RecordingError(
            f"A message of {topic} does not fit the recording format: {', '.join(wrong)}. "
            f"Allowed: {', '.join(field.name for field in channel.fields)}."
        )
    try:
        return json.dumps(message, allow_nan=False, default=_plain, ensure_ascii=False).encode()
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
    raise TypeError(f"{type(value).__name__} has no place in JSON")
