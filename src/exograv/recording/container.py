"""An MCAP file, chunk by chunk. The mcap package writes message by message, which takes longer than a tick's own work.

Source of the layout: MCAP specification, version 0. Whole chunks are on disk when `add_chunk` returns.
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

from .schema import SCHEMA_VERSION

RECORD_HEAD = struct.Struct("<BQ")
"""Operation code and length before each record."""

MESSAGE_HEAD = struct.Struct("<HIQQ")
"""Channel, sequence, log time and publish time [ns] before the data of a message."""

MESSAGE = np.dtype(
    [("opcode", "u1"), ("length", "<u8"), ("channel", "<u2"), ("sequence", "<u4"), ("times_ns", "<u8", (2,))]
)
"""`RECORD_HEAD` and `MESSAGE_HEAD` in one, for messages in rows."""

INDEX_ENTRY = np.dtype([("time_ns", "<u8"), ("offset", "<u8")])
"""Where in its uncompressed chunk a message is."""

COMPRESSION_LEVEL = 1
"""Of zstd: less than half the time of its default, 3, for 2 % more bytes (measured on ticks of a demo)."""


class ChunkedFile:
    """Channels first, then compressed chunks of messages, and an index of all at the end."""

    def __init__(self, stream: BinaryIO):
        self._stream = stream
        self._schemas: list[Schema] = []
        self._channels: list[Channel] = []
        self._chunks: list[ChunkIndex] = []
        self._counts: dict[int, int] = {}
        stream.write(MCAP0_MAGIC)
        self._put(Header(profile="", library=f"exograv recording {SCHEMA_VERSION}"))

    def add_channel(self, topic: str, encoding: str, schema: Schema) -> int:
        """Announce a channel and its schema, before any chunk; returns the channel's number."""
        self._schemas.append(schema)
        self._channels.append(Channel(len(self._channels) + 1, topic, encoding, {}, schema.id))
        self._put(self._schemas[-1], self._channels[-1])
        return self._channels[-1].id

    def add_chunk(self, messages: bytes, index: Mapping[int, np.ndarray]) -> None:
        """Write message records, compressed.

        Args:
            messages: The records, one after another.
            index: By channel, an `INDEX_ENTRY` for each of its messages; at least one.
        """
        times = np.concatenate([entries["time_ns"] for entries in index.values()])
        first, last = int(times.min()), int(times.max())
        packed, start = zstandard.compress(messages, COMPRESSION_LEVEL), self._stream.tell()
        chunk = Chunk(
            compression="zstd",
            data=packed,
            message_start_time=first,
            message_end_time=last,
            uncompressed_crc=zlib.crc32(messages),
            uncompressed_size=len(messages),
        )
        length = self._put(chunk)
        self._put_indexes(chunk, start, length, index)
        for channel, entries in index.items():
            self._counts[channel] = self._counts.get(channel, 0) + len(entries)
        self._stream.flush()

    def finish(self) -> None:
        """Write the index of the whole file; the stream stays open."""
        self._put(DataEnd(data_section_crc=0))
        start = self._stream.tell()
        self._put(*self._schemas, *self._channels, self._statistics(), *self._chunks)
        self._put(Footer(summary_start=start, summary_offset_start=0, summary_crc=0))
        self._stream.write(MCAP0_MAGIC)

    def _put(self, *records: McapRecord) -> int:
        builder = RecordBuilder()
        for record in records:
            record.write(builder)
        return self._stream.write(builder.end())

    def _put_indexes(self, chunk: Chunk, start: int, length: int, index: Mapping[int, np.ndarray]) -> None:
        offsets = {}
        for channel, entries in index.items():
            offsets[channel] = self._stream.tell()
            body = struct.pack("<HI", channel, entries.nbytes) + entries.tobytes()
            self._stream.write(RECORD_HEAD.pack(Opcode.MESSAGE_INDEX, len(body)) + body)
        chunk_index = ChunkIndex(
            chunk_start_offset=start,
            chunk_length=length,
            compression=chunk.compression,
            compressed_size=len(chunk.data),
            uncompressed_size=chunk.uncompressed_size,
            message_start_time=chunk.message_start_time,
            message_end_time=chunk.message_end_time,
            message_index_offsets=offsets,
            message_index_length=self._stream.tell() - start - length,
        )
        self._chunks.append(chunk_index)

    def _statistics(self) -> Statistics:
        return Statistics(
            attachment_count=0,
            channel_count=len(self._channels),
            channel_message_counts=self._counts,
            chunk_count=len(self._chunks),
            message_count=sum(self._counts.values()),
            message_end_time=max((chunk.message_end_time for chunk in self._chunks), default=0),
            message_start_time=min((chunk.message_start_time for chunk in self._chunks), default=0),
            metadata_count=0,
            schema_count=len(self._schemas),
        )
