"""MCAP file, written chunk by chunk.

The mcap package writes message by message, which takes longer than a tick's own work. Source of the layout: MCAP
specification, version 0. When `add_chunk` returns, the operating system has the whole chunk, and a killed writer leaves
it behind. To survive a power failure, the caller must sync the file (fdatasync).
"""

import struct
import zlib
from collections.abc import Mapping
from typing import BinaryIO

import numpy as np
import zstandard
from mcap.data_stream import RecordBuilder
from mcap.opcode import Opcode
from mcap.records import Channel, Chunk, ChunkIndex, DataEnd, Footer, Header, McapRecord, Schema, Statistics
from mcap.writer import MCAP0_MAGIC

from .chunk_list import ChunkList
from .schema import SCHEMA_VERSION

RECORD_HEAD = struct.Struct("<BQ")
"""Operation code and length before each record."""

MESSAGE_HEAD = struct.Struct("<HIQQ")
"""Channel, sequence, log time and publish time [ns] before the data of a message."""

MESSAGE = np.dtype(
    [("opcode", "u1"), ("length", "<u8"), ("channel", "<u2"), ("sequence", "<u4"), ("times_ns", "<u8", (2,))]
)
"""`RECORD_HEAD` and `MESSAGE_HEAD` in one type, for rows of messages."""

INDEX_ENTRY = np.dtype([("time_ns", "<u8"), ("offset", "<u8")])
"""Log time of a message, and its offset in the uncompressed chunk."""

FOOTER = struct.Struct("<QQI")
"""Start of the summary, start of its offsets (unused), and `summary_crc`."""

COMPRESSION_LEVEL = 1
"""Level of zstd: it takes less than half the time of the default, 3, for 2 % more bytes (measured on demo ticks)."""


Index = Mapping[int, np.ndarray]
"""Entries of `INDEX_ENTRY` by channel, one for each of its messages; at least one entry in all."""


class MessageIndexes:
    """Index records that follow a chunk, one per channel."""

    def __init__(self, index: Index, start: int):
        parts = [struct.pack("<HI", channel, entries.nbytes) + entries.tobytes() for channel, entries in index.items()]
        records = [RECORD_HEAD.pack(Opcode.MESSAGE_INDEX, len(part)) + part for part in parts]
        places = start + np.cumsum([0, *(len(record) for record in records)])
        self.records = b"".join(records)
        self.offsets = {channel: int(place) for channel, place in zip(index, places, strict=False)}
        """Position of each channel's record in the file, if the first one is at `start`."""


def time_span_ns(index: Index) -> tuple[int, int]:
    """First and last log time [ns]."""
    times = np.concatenate([entries["time_ns"] for entries in index.values()])
    return int(times.min()), int(times.max())


def chunk_index(chunk: Chunk, place: tuple[int, int], indexes: MessageIndexes) -> ChunkIndex:
    """Return the summary's entry for a chunk between these bytes of the file."""
    return ChunkIndex(
        chunk_start_offset=place[0],
        chunk_length=place[1] - place[0],
        compression=chunk.compression,
        compressed_size=len(chunk.data),
        uncompressed_size=chunk.uncompressed_size,
        message_start_time=chunk.message_start_time,
        message_end_time=chunk.message_end_time,
        message_index_offsets=indexes.offsets,
        message_index_length=len(indexes.records),
    )


def summary_crc(summary: bytes, start: int) -> int:
    """Checksum in the footer, over the summary and the footer's own first fields."""
    return zlib.crc32(struct.pack("<BQQQ", Opcode.FOOTER, FOOTER.size, start, 0), zlib.crc32(summary))


class ChunkedFile:
    """MCAP file with channels first, then compressed chunks of messages, and an index at the end."""

    def __init__(self, stream: BinaryIO):
        self._stream = stream
        self._crc = 0
        self.schemas: list[Schema] = []
        self.channels: list[Channel] = []
        self.chunks = ChunkList()
        self.counts: dict[int, int] = {}
        """Number of messages by channel."""

    def begin(self) -> None:
        """Write the start of an MCAP file."""
        self._write(MCAP0_MAGIC)
        self._put(Header(profile="", library=f"exograv recording {SCHEMA_VERSION}"))

    def resume(self, crc: int, written: int) -> None:
        """Continue after so many bytes with this CRC-32; channels, chunks and counts have been restored."""
        self._crc = crc
        self._stream.seek(written)

    def add_channel(self, topic: str, encoding: str, schema: Schema) -> int:
        """Write a channel and its schema, before any chunk, and return the channel's number."""
        self.schemas.append(schema)
        self.channels.append(Channel(len(self.channels) + 1, topic, encoding, {}, schema.id))
        self._put(self.schemas[-1], self.channels[-1])
        return self.channels[-1].id

    def add_chunk(self, messages: bytes, index: Index) -> None:
        """Write message records as a compressed chunk."""
        first, last = time_span_ns(index)
        packed, start = zstandard.compress(messages, COMPRESSION_LEVEL), self._stream.tell()
        chunk = Chunk(
            compression="zstd",
            data=packed,
            message_start_time=first,
            message_end_time=last,
            uncompressed_crc=zlib.crc32(messages),
            uncompressed_size=len(messages),
        )
        end = start + self._put(chunk)
        indexes = MessageIndexes(index, end)
        self._write(indexes.records)
        self._stream.flush()
        self.chunks.append(chunk_index(chunk, (start, end), indexes))
        for channel, entries in index.items():
            self.counts[channel] = self.counts.get(channel, 0) + len(entries)

    def finish(self) -> None:
        """Write the index of the whole file; the stream stays open."""
        self._put(DataEnd(data_section_crc=self._crc))
        start, summary = self._stream.tell(), RecordBuilder()
        for record in (*self.schemas, *self.channels, self._statistics(), *self.chunks):
            record.write(summary)
        records = summary.end()
        self._write(records)
        self._put(Footer(summary_start=start, summary_offset_start=0, summary_crc=summary_crc(records, start)))
        self._write(MCAP0_MAGIC)
        self._stream.flush()

    def _put(self, *records: McapRecord) -> int:
        builder = RecordBuilder()
        for record in records:
            record.write(builder)
        return self._write(builder.end())

    def _write(self, data: bytes) -> int:
        self._crc = zlib.crc32(data, self._crc)
        return self._stream.write(data)

    def _statistics(self) -> Statistics:
        return Statistics(
            attachment_count=0,
            channel_count=len(self.channels),
            channel_message_counts=self.counts,
            chunk_count=len(self.chunks),
            message_count=sum(self.counts.values()),
            message_end_time=self.chunks.time_span_ns[1],
            message_start_time=self.chunks.time_span_ns[0],
            metadata_count=0,
            schema_count=len(self.schemas),
        )
