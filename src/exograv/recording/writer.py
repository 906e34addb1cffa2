"""Writes a recording while the run goes on: what is killed loses at most the last chunk."""

import contextlib
import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from types import TracebackType
from typing import Any

import numpy as np
from mcap.writer import CompressionType, IndexType, Writer

from exograv.errors import RecordingError

from .encoding import CDR_HEADER, json_schema, misfits, tick_definition, tick_dtype
from .schema import CHANNELS, SCHEMA_VERSION, TICK

# A chunk is what compression and an abrupt end work on: 1 MB is about five seconds of ticks.
CHUNK_BYTES = 1_000_000
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
        self._record = np.zeros((), tick_dtype(len(joints)))
        self._record["cdr_header"] = np.frombuffer(CDR_HEADER, np.uint8)
        self._values = {
            field.name: self._record[field.name] for field in TICK.fields if field.name not in ("t", "phase")
        }
        self._t, self._phase = self._record["t"], self._record["phase"]
        self._pending = 0
        try:
            self.path.parent.mkdir(parents=True, exist_ok=True)
            self._stream = open(self.path, "wb")  # noqa: SIM115 - closed by `close`
        except OSError as error:
            raise self._unwritable(error) from error
        self._mcap = Writer(
            self._stream, chunk_size=1 << 62, compression=CompressionType.ZSTD, index_types=IndexType.ALL
        )
        self._mcap.start(library=f"exograv recording {SCHEMA_VERSION}")
        self._ids = {topic: self._register(topic, len(joints)) for topic in CHANNELS}
        self.write("/settings", 0.0, {"schema_version": SCHEMA_VERSION, "joints": list(joints), **settings})

    def tick(self, t: float, **values: Any) -> None:
        """Record one period; every value of the `/tick` table but `t` and `phase`, by its name.

        Raises:
            RecordingError: The disk is full or gone.
            ValueError: A value is missing: it would silently keep that of the tick before.
        """
        if len(values) != len(self._values):
            raise ValueError(f"/tick needs {', '.join(self._values)}; given were {', '.join(values)}.")
        self._t[...] = t
        for name, value in values.items():
            self._values[name][...] = value
        self._add("/tick", t, self._record.tobytes())

    def phase(self, t: float, name: str) -> None:
        """Say what the session does from `t` on; the ticks that follow belong to it."""
        self.write("/phase", t, {"name": name})
        self._phase[...] += 1

    def write(self, topic: str, t: float, message: Mapping[str, Any]) -> None:
        """Record a message of a JSON channel; `t` [s] is added to it where the channel has one.

        Raises:
            RecordingError: The message does not fit the channel, or the disk is full or gone.
        """
        channel = CHANNELS[topic]
        if channel.fields[0].name == "t":
            message = {"t": t, **message}
        if wrong := misfits(channel, message):
            raise RecordingError(
                f"A message of {topic} does not fit the recording format: {', '.join(wrong)}. "
                f"Allowed: {', '.join(field.name for field in channel.fields)}."
            )
        try:
            data = json.dumps(message, allow_nan=False, default=_plain, ensure_ascii=False).encode()
        except (TypeError, ValueError) as error:
            raise RecordingError(
                f"A message of {topic} at {t} s cannot be written: {error}. Use null for 'none'."
            ) from error
        self._add(topic, t, data)
        if topic in AT_ONCE:
            self._flush()

    def close(self) -> None:
        """Complete the file; does nothing the second time."""
        if self._stream.closed:
            return
        try:
            self._mcap.finish()
            self._stream.close()
        except OSError as error:
            raise self._unwritable(error) from error

    def __enter__(self) -> "RecordingWriter":
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def _register(self, topic: str, n_joints: int) -> int:
        channel = CHANNELS[topic]
        if channel.encoding == "cdr":
            encoding, definition = "ros2msg", tick_definition(n_joints)
        else:
            encoding, definition = "jsonschema", json.dumps(json_schema(channel.fields, n_joints), ensure_ascii=False)
        schema = self._mcap.register_schema(channel.schema_name, encoding, definition.encode())
        return self._mcap.register_channel(topic, channel.encoding, schema)

    def _add(self, topic: str, t: float, data: bytes) -> None:
        time_ns = round(1e9 * t)
        self._mcap.add_message(self._ids[topic], time_ns, data, time_ns)
        self._pending += len(data)
        if self._pending > CHUNK_BYTES:
            self._flush()

    def _flush(self) -> None:
        self._pending = 0
        try:
            self._mcap.flush()
        except OSError as error:
            with contextlib.suppress(OSError):  # what is still in its buffer fails again
                self._stream.close()
            raise self._unwritable(error) from error

    def _unwritable(self, error: OSError) -> RecordingError:
        return RecordingError(
            f"The recording {self.path} cannot be written: {error.strerror}. "
            "Free some space there, or give another folder with --out."
        )


def _plain(value: Any) -> Any:
    if isinstance(value, np.ndarray | np.generic):
        return value.tolist()
    raise TypeError(f"{type(value).__name__} has no place in JSON")
