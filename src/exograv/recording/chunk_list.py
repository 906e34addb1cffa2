"""Packed list of the chunks of a file's index; a recording makes four chunks a second, for hours."""

import struct
from collections.abc import Iterator

from mcap.records import ChunkIndex

CHUNK = struct.Struct("<QIQQIIIBB")
"""Offset and length in the file, first time and time span [ns], compressed and uncompressed size, length of the
message indexes, index of the compression, and number of channels.
"""

CHANNEL = struct.Struct("<HI")
"""Channel number, and offset of its message index after the end of the chunk."""


class ChunkList:
    """Chunks in the order of the file, in 60 bytes per chunk; a list of records takes 700."""

    def __init__(self):
        self._packed, self._count = bytearray(), 0
        self._compressions: list[str] = []
        self.time_span_ns = (0, 0)
        """First and last log time in any chunk; zeros before the first chunk."""

    def __len__(self) -> int:
        """Return the number of chunks."""
        return self._count

    def __iter__(self) -> Iterator[ChunkIndex]:
        """Yield the chunks as records."""
        at = 0
        for _ in range(self._count):
            start, length, first, span, compressed, size, indexes, compression, channels = CHUNK.unpack_from(
                self._packed, at
            )
            at += CHUNK.size
            places = [CHANNEL.unpack_from(self._packed, at + k * CHANNEL.size) for k in range(channels)]
            at += channels * CHANNEL.size
            yield ChunkIndex(
                chunk_start_offset=start,
                chunk_length=length,
                compression=self._compressions[compression],
                compressed_size=compressed,
                uncompressed_size=size,
                message_start_time=first,
                message_end_time=first + span,
                message_index_offsets={channel: start + length + place for channel, place in places},
                message_index_length=indexes,
            )

    def append(self, chunk: ChunkIndex) -> None:
        """Append the index entry of one chunk."""
        if chunk.compression not in self._compressions:
            self._compressions.append(chunk.compression)
        first, last = chunk.message_start_time, chunk.message_end_time
        end = chunk.chunk_start_offset + chunk.chunk_length
        self._packed += CHUNK.pack(
            chunk.chunk_start_offset,
            chunk.chunk_length,
            first,
            last - first,
            chunk.compressed_size,
            chunk.uncompressed_size,
            chunk.message_index_length,
            self._compressions.index(chunk.compression),
            len(chunk.message_index_offsets),
        )
        for channel, place in chunk.message_index_offsets.items():
            self._packed += CHANNEL.pack(channel, place - end)
        least, most = self.time_span_ns if self._count else (first, last)
        self.time_span_ns = min(least, first), max(most, last)
        self._count += 1
