"""Reads a recording back, also one whose writer was killed: everything up to the last whole chunk."""

import json
import struct
from collections import defaultdict
from collections.abc import Iterator
from dataclasses import dataclass
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
import zstandard
from mcap.data_stream import ReadDataStream
from mcap.exceptions import McapError
from mcap.opcode import Opcode
from mcap.records import Channel as ChannelRecord
from mcap.records import Chunk
from mcap.stream_reader import CRCValidationError, get_chunk_data_stream
from mcap.writer import MCAP0_MAGIC

from exograv.errors import RecordingError

from .container import MESSAGE, MESSAGE_HEAD, RECORD_HEAD
from .encoding import tick_dtype
from .schema import CHANNELS, SCHEMA_VERSION, TICK

DAMAGE = (McapError, CRCValidationError, zstandard.ZstdError, struct.error)


@dataclass(frozen=True)
class Recording:
    """A recording in memory."""

    path: Path
    settings: dict[str, Any]
    """The message of `/settings`."""

    ticks: np.ndarray
    """Structured array, one record a tick; fields and units in the table of `/tick`."""

    remark: str | None
    """What is wrong with the file, as a sentence; None for a complete one."""

    _messages: dict[str, list[dict[str, Any]]]

    @property
    def joints(self) -> tuple[str, ...]:
        """Actuated joints, in the order of every per-joint array."""
        return tuple(self.settings["joints"])

    def messages(self, topic: str) -> list[dict[str, Any]]:
        """All messages of a JSON channel, in the order of writing; empty if there are none."""
        return self._messages.get(topic, [])

    def last(self, topic: str) -> dict[str, Any]:
        """The last message of a JSON channel, or an empty one."""
        return (self.messages(topic) or [{}])[-1]

    def phase_ticks(self, name: str) -> np.ndarray:
        """The ticks of the last phase of this name; empty if there was none."""
        numbers = [k for k, phase in enumerate(self.messages("/phase"), start=1) if phase["name"] == name]
        return self.ticks[self.ticks["phase"] == (numbers or [-1])[-1]]


def read_recording(path: Path) -> Recording:
    """Read a whole recording.

    Raises:
        RecordingError: There is no such file, it is no recording of exograv, or one of another version.
    """
    path = Path(path)
    try:
        content = path.read_bytes()
    except OSError as error:
        raise RecordingError(f"The recording {path} cannot be read: {error.strerror}. Check its path.") from error
    if not content.startswith(MCAP0_MAGIC):
        raise RecordingError(f"{path} is no MCAP file. A recording of exograv ends in .mcap and begins with its mark.")
    parts, complete = _messages_by_topic(content)
    if not parts["/settings"]:
        raise RecordingError(
            f"{path} holds no /settings: exograv did not write it, or it was cut before its first chunk."
        )
    settings = json.loads(parts["/settings"][0])
    if settings.get("schema_version") != SCHEMA_VERSION:
        raise RecordingError(
            f"{path} has version {settings.get('schema_version')} of the recording format; this exograv reads "
            f"{SCHEMA_VERSION}. Read it with the version that wrote it: {settings.get('versions', 'unknown')}."
        )
    ticks = np.frombuffer(b"".join(parts["/tick"]), tick_dtype(len(settings["joints"])))
    messages = {topic: [json.loads(data) for data in parts[topic]] for topic in CHANNELS if topic != "/tick"}
    remark = None if complete else _ending(path, ticks)
    return Recording(path, settings, ticks, remark, messages)


def _ending(path: Path, ticks: np.ndarray) -> str:
    until = f"at {ticks['t'][-1]:.3f} s" if len(ticks) else "before the first tick"
    return f"{path.name} ends abruptly {until}: its writer was stopped, and what was not yet on disk is lost."


def _messages_by_topic(content: bytes) -> tuple[defaultdict[str, list[bytes]], bool]:
    """Data of all whole messages, and whether the file was completed."""
    found: defaultdict[str, list[bytes]] = defaultdict(list)
    topics: dict[int, str] = {}
    complete = False
    try:
        for opcode, body in _records(content[len(MCAP0_MAGIC) :]):
            if opcode == Opcode.CHUNK:
                _read_chunk(body, topics, found)
            elif opcode == Opcode.CHANNEL:
                channel = ChannelRecord.read(ReadDataStream(BytesIO(body)))
                topics[channel.id] = channel.topic
            complete |= opcode == Opcode.FOOTER
    except DAMAGE:
        return found, False
    return found, complete


def _read_chunk(body: bytes, topics: dict[int, str], found: defaultdict[str, list[bytes]]) -> None:
    stream, length = get_chunk_data_stream(Chunk.read(ReadDataStream(BytesIO(body))), validate_crc=True)
    content, start = stream.read(length), 0
    while record := _record_at(content, start):
        opcode, data = record
        following = start + RECORD_HEAD.size + len(data)
        if opcode == Opcode.MESSAGE:
            topic = topics[MESSAGE_HEAD.unpack_from(data)[0]]
            if topic == TICK.topic:
                ticks = _equal_messages(content, start, following - start)
                found[topic].append(ticks["data"].tobytes())
                following = start + ticks.nbytes
            else:
                found[topic].append(data[MESSAGE_HEAD.size :])
        start = following


def _equal_messages(content: bytes, start: int, size: int) -> np.ndarray:
    """The message at `start` and those like it that follow at once: ticks, thousands of them in a row."""
    count = (len(content) - start) // size
    like = np.dtype([("head", MESSAGE), ("data", f"V{size - MESSAGE.itemsize}")])
    rows = np.frombuffer(content, like, count, start)
    kinds = rows["head"][["opcode", "length", "channel"]]
    others = np.flatnonzero(kinds != kinds[0])
    return rows[: others[0]] if len(others) else rows


def _records(content: bytes) -> Iterator[tuple[int, bytes]]:
    """The whole records in these bytes; one that is cut ends them."""
    start = 0
    while record := _record_at(content, start):
        yield record
        start += RECORD_HEAD.size + len(record[1])


def _record_at(content: bytes, start: int) -> tuple[int, bytes] | None:
    """Operation code and data of the whole record that begins here; None at the end, and where it is cut."""
    if start + RECORD_HEAD.size > len(content):
        return None
    opcode, length = RECORD_HEAD.unpack_from(content, start)
    first = start + RECORD_HEAD.size
    return (opcode, content[first : first + length]) if first + length <= len(content) else None
