"""Check of a file's content: each record by its place, each chunk by its checksum and index.

A file may be cut anywhere (its writer was killed, the power failed) and altered anywhere (a failing disk). The part
before the first error is good. The erroneous part and all that follows is not used.
"""

import enum
import struct
import zlib
from collections.abc import Callable, Generator, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from io import BytesIO
from typing import Protocol, runtime_checkable

import numpy as np
import zstandard
from mcap.data_stream import ReadDataStream
from mcap.exceptions import McapError
from mcap.opcode import Opcode
from mcap.records import Channel, Chunk, Header, Schema
from mcap.writer import MCAP0_MAGIC

from .chunk_list import ChunkList
from .container import (
    FOOTER,
    INDEX_ENTRY,
    MESSAGE,
    MESSAGE_HEAD,
    RECORD_HEAD,
    MessageIndexes,
    chunk_index,
    summary_crc,
    time_span_ns,
)
from .schema import CHANNELS, TICK
from .stream_block import TOPICS
from .tick_columns import COLUMNS_TOPIC, unpack


class DamageError(Exception):
    """Violation of the file format; used in this file only, callers see a `FileEnding`."""


DAMAGE = (DamageError, McapError, zstandard.ZstdError, struct.error, UnicodeDecodeError, OverflowError)
"""Errors that the content of a cut or altered file can raise."""


@runtime_checkable
class Content(Protocol):
    """Bytes of a file, in memory or read from it."""

    def __len__(self) -> int:
        """Return the number of bytes."""
        ...

    def __getitem__(self, part: slice, /) -> bytes:
        """Return the bytes of a part."""
        ...


UNPACKED_BYTES_MAX = 64_000_000
"""Largest size of an unpacked chunk [byte]. The writer's chunks have about 1 MB; 100 kB can unpack to gigabytes."""

CRC_BYTES = 1_000_000
"""Bytes that one step reads."""


def crc_of(content: Content, end: int) -> int:
    """CRC-32 of the first `end` bytes."""
    crc = 0
    for start in range(0, end, CRC_BYTES):
        crc = zlib.crc32(content[start : min(start + CRC_BYTES, end)], crc)
    return crc


Visit = Callable[[str, bytes], None]
"""Callback that receives the topic and the data of a message. Consecutive ticks come as one call."""


class FileEnding(enum.Enum):
    """State of the end of a recording file: complete, cut off or damaged."""

    COMPLETE = "complete"
    CUT = "cut"
    DAMAGED = "damaged"


@dataclass
class Contents:
    """Content of a file that was found good."""

    schemas: list[Schema] = field(default_factory=list)
    channels: list[Channel] = field(default_factory=list)
    chunks: ChunkList = field(default_factory=ChunkList)

    counts: dict[int, int] = field(default_factory=dict)
    """Number of messages by channel, in chunks whose index is complete too."""

    ticks: int = 0
    """Number of ticks, in the same chunks."""

    good: int = 0
    """Bytes up to the end of the last complete chunk and its index; a file cut here can be continued."""

    ending: FileEnding = FileEnding.CUT

    @property
    def topics(self) -> dict[int, str]:
        """Topics of the channels, by channel number."""
        return {channel.id: channel.topic for channel in self.channels}


@dataclass(frozen=True)
class ChunkPart:
    """Message of a chunk, or ticks that follow each other there."""

    topic: str
    data: bytes | np.ndarray
    """Data of the message; of ticks their rows as bytes, or, unpacked from columns, as an array (tick,)."""

    chunk: int
    """Start of the chunk in the file."""

    offset: int
    """Start of the message in the uncompressed chunk."""


def examine(content: Content, visit: Visit) -> Contents:
    """Examine a file that begins with the mark of MCAP, and visit each message of a good chunk in order."""
    found = Contents()
    for topic, data in messages_in(content, found):
        visit(topic, data)
    return found


def messages_in(content: Content, found: Contents) -> Iterator[tuple[str, bytes]]:
    """Yield topic and data as `examine` visits them, with one chunk in memory at a time; fill in `found` on the way."""
    for part in parts_in(content, found):
        yield part.topic, part.data if isinstance(part.data, bytes) else part.data.tobytes()


@dataclass(frozen=True)
class FileHead:
    """First part of a file, as if the file had been cut at `end`."""

    content: Content
    end: int

    def __len__(self) -> int:
        return self.end

    def __getitem__(self, part: slice, /) -> bytes:
        start, stop, _ = part.indices(self.end)
        return self.content[start:stop]


def end_of_kept(content: Content, kept: Mapping[str, int]) -> int:
    """Return the start of the first chunk in which a topic has more messages than `kept`; the size without one."""
    counts = dict.fromkeys(kept, 0)
    for part in parts_in(content, Contents()):
        if part.topic in counts:
            counts[part.topic] += 1
            if counts[part.topic] > kept[part.topic]:
                return part.chunk
    return len(content)


def parts_in(content: Content, found: Contents, fields: Sequence[str] | None = None) -> Iterator[ChunkPart]:
    """Yield the parts of each chunk, with one chunk in memory at a time; fill in `found` on the way.

    Args:
        content: File that begins with the mark of MCAP.
        found: Empty contents.
        fields: Fields that are unpacked from ticks that were packed by column; all without it.
    """
    try:
        found.ending = yield from _walk(content, found, fields)
    except DAMAGE:
        found.ending = FileEnding.DAMAGED


def parts_at(
    content: Content, chunk: int, topics: dict[int, str], fields: Sequence[str] | None = None
) -> Iterator[ChunkPart]:
    """Yield the parts of the chunk at this place, which `parts_in` has found good."""
    found = dict[int, list[np.ndarray]]()
    yield from _parts(chunk_data(content, chunk), chunk, topics, fields, found)


def chunk_data(content: Content, chunk: int) -> bytes:
    """Return the uncompressed messages of the chunk at this place, which `parts_in` has found good."""
    record = _record_at(content, chunk)
    return b"" if record is None else _unpacked(Chunk.read(ReadDataStream(BytesIO(record[1]))))


def message_data(chunk: bytes, offset: int) -> bytes:
    """Return the data of the message at this place of an uncompressed chunk."""
    record = _record_at(chunk, offset)
    return b"" if record is None else record[1][MESSAGE_HEAD.size :]


def _walk(content: Content, found: Contents, fields: Sequence[str] | None) -> Generator[ChunkPart, None, FileEnding]:
    start = found.good = len(MCAP0_MAGIC)
    while record := _record_at(content, start):
        opcode, body = record
        end = start + RECORD_HEAD.size + len(body)
        if opcode == Opcode.CHUNK:
            chunk = Chunk.read(ReadDataStream(BytesIO(body)))
            after = yield from _chunk(chunk, content, (start, end), found, fields)
            if after is None:
                return FileEnding.CUT
            end = after
        elif opcode == Opcode.DATA_END:
            return _finish(content, start, end)
        else:
            _announce(opcode, body, found)
        start = found.good = end
    return FileEnding.CUT


def _announce(opcode: int, body: bytes, found: Contents) -> None:
    """Take a record before the first chunk."""
    stream = ReadDataStream(BytesIO(body))
    if found.chunks:
        raise DamageError
    if opcode == Opcode.CHANNEL:
        channel = Channel.read(stream)
        is_known = channel.topic in CHANNELS or channel.topic == COLUMNS_TOPIC or channel.topic.startswith(TOPICS)
        if not is_known or channel.id in found.topics or channel.topic in found.topics.values():
            raise DamageError
        found.channels.append(channel)
    elif opcode == Opcode.SCHEMA:
        found.schemas.append(Schema.read(stream))
    elif opcode == Opcode.HEADER and not found.schemas:
        Header.read(stream)
    else:
        raise DamageError


def _chunk(
    chunk: Chunk, content: Content, place: tuple[int, int], found: Contents, fields: Sequence[str] | None
) -> Generator[ChunkPart, None, int | None]:
    """Yield a chunk's parts; return the end of its index, or None if the file ends before it."""
    parts: dict[int, list[np.ndarray]] = {}
    ticks = yield from _parts(_unpacked(chunk), place[0], found.topics, fields, parts)
    if not parts:  # our writer writes no empty chunk
        raise DamageError
    index = {channel: np.concatenate(entries) for channel, entries in parts.items()}
    expected = MessageIndexes(index, place[1])
    stored = content[place[1] : place[1] + len(expected.records)]
    times = (chunk.message_start_time, chunk.message_end_time)
    if not expected.records.startswith(stored) or times != time_span_ns(index):
        raise DamageError
    if len(stored) < len(expected.records):
        return None
    found.chunks.append(chunk_index(chunk, place, expected))
    for channel, entries in index.items():
        found.counts[channel] = found.counts.get(channel, 0) + len(entries)
    found.ticks += ticks
    return place[1] + len(expected.records)


def _parts(
    data: bytes,
    chunk: int,
    topics: dict[int, str],
    fields: Sequence[str] | None,
    index: dict[int, list[np.ndarray]],
) -> Generator[ChunkPart, None, int]:
    """Yield the parts of an uncompressed chunk, put their entries into `index`, and return the number of ticks."""
    is_packed, ticks = COLUMNS_TOPIC in topics.values(), 0
    for channel, entries, messages in _messages(data, topics):
        topic, offset = topics[channel], int(entries["offset"][0])
        if topic == COLUMNS_TOPIC:
            rows = _rows(messages, fields)
            ticks += len(rows)
            yield ChunkPart(TICK.topic, rows, chunk, offset)
        elif topic != TICK.topic:
            yield ChunkPart(topic, messages, chunk, offset)
        elif not is_packed:
            ticks += len(entries)
            yield ChunkPart(topic, messages, chunk, offset)
        index.setdefault(channel, []).append(entries)
    return ticks


def _unpacked(chunk: Chunk) -> bytes:
    # The sizes are checked first, so that a chunk cannot demand more memory than there is.
    if chunk.uncompressed_size > UNPACKED_BYTES_MAX or chunk.compression != "zstd":
        raise DamageError
    if zstandard.frame_content_size(chunk.data) != chunk.uncompressed_size:
        raise DamageError
    data = zstandard.decompress(chunk.data)
    if zlib.crc32(data) != chunk.uncompressed_crc:
        raise DamageError
    return data


def _messages(data: bytes, topics: dict[int, str]) -> Iterator[tuple[int, np.ndarray, bytes]]:
    """Yield channel, `INDEX_ENTRY` per message, and data; ticks that follow each other are one."""
    start = 0
    while record := _record_at(data, start):
        opcode, body = record
        if opcode != Opcode.MESSAGE:
            raise DamageError
        channel, _, time_ns, _ = MESSAGE_HEAD.unpack_from(body)
        following = start + RECORD_HEAD.size + len(body)
        if channel not in topics:
            raise DamageError
        if topics[channel] == TICK.topic:
            rows = _equal_messages(data, start, following - start)
            entries = np.empty(len(rows), INDEX_ENTRY)
            entries["time_ns"] = rows["head"]["times_ns"][:, 0]
            entries["offset"] = start + rows.itemsize * np.arange(len(rows))
            yield channel, entries, rows["data"].tobytes()
            following = start + rows.nbytes
        else:
            yield channel, np.array([(time_ns, start)], INDEX_ENTRY), body[MESSAGE_HEAD.size :]
        start = following


def _rows(message: bytes, fields: Sequence[str] | None) -> np.ndarray:
    try:
        return unpack(message, fields)
    except ValueError as error:
        raise DamageError from error


def _equal_messages(content: bytes, start: int, size: int) -> np.ndarray:
    """Return the message at `start` and the equal ones that follow it directly: ticks, thousands of them in a row."""
    count = (len(content) - start) // size
    like = np.dtype([("head", MESSAGE), ("data", f"V{size - MESSAGE.itemsize}")])
    rows = np.frombuffer(content, like, count, start)
    kinds = rows["head"][["opcode", "length", "channel"]]
    others = np.flatnonzero(kinds != kinds[0])
    return rows[: others[0]] if len(others) else rows


def _finish(content: Content, start: int, summary: int) -> FileEnding:
    """Check the data before `start` by the checksum in the data-end record, and the summary by that in the footer.

    A checksum of 0 was not computed and is accepted. Return CUT if the file ends before its last bytes.
    """
    body = content[start + RECORD_HEAD.size : summary]
    if body not in (crc_of(content, start).to_bytes(4, "little"), bytes(4)):  # zeros: not computed, as in version 1
        raise DamageError
    at = summary
    while record := _record_at(content, at):
        opcode, body = record
        after = at + RECORD_HEAD.size + len(body)
        if opcode == Opcode.FOOTER:
            right = summary_crc(content[summary:at], summary)
            if body not in (FOOTER.pack(summary, 0, right), FOOTER.pack(summary, 0, 0)):
                raise DamageError
            return FileEnding.COMPLETE if content[after : len(content)] == MCAP0_MAGIC else FileEnding.CUT
        at = after
    return FileEnding.CUT


def _record_at(content: Content, start: int) -> tuple[int, bytes] | None:
    """Return operation code and data of the complete record at `start`; None at the end, or if it is cut."""
    if start + RECORD_HEAD.size > len(content):
        return None
    first = start + RECORD_HEAD.size
    opcode, length = RECORD_HEAD.unpack(content[start:first])
    return (opcode, content[first : first + length]) if first + length <= len(content) else None
