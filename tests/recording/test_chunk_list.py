"""The index of a file is complete, and an hour of recording keeps little of it in memory."""

import tracemalloc

from hypothesis import given
from hypothesis import strategies as st
from mcap.records import ChunkIndex

from exograv.recording.chunk_list import ChunkList

CHUNKS_PER_HOUR = 4 * 3600
GROWTH_MAX = 1_000_000
"""Largest growth of memory in an hour, for F37 [bytes]."""


@st.composite
def chunks(draw: st.DrawFn) -> ChunkIndex:
    start, length = draw(st.integers(0, 2**40)), draw(st.integers(0, 2**31))
    first, places = draw(st.integers(0, 2**62)), draw(st.dictionaries(st.integers(1, 99), st.integers(0, 2**31)))
    return ChunkIndex(
        chunk_start_offset=start,
        chunk_length=length,
        compression=draw(st.sampled_from(["", "zstd", "lz4"])),
        compressed_size=draw(st.integers(0, 2**31)),
        uncompressed_size=draw(st.integers(0, 2**31)),
        message_start_time=first,
        message_end_time=first + draw(st.integers(0, 2**62)),
        message_index_offsets={channel: start + length + place for channel, place in places.items()},
        message_index_length=draw(st.integers(0, 2**31)),
    )


@given(st.lists(chunks(), min_size=1))
def test_every_chunk_comes_back_unchanged(many: list[ChunkIndex]):
    kept = ChunkList()
    for chunk in many:
        kept.append(chunk)
    assert list(kept) == many
    assert len(kept) == len(many)
    times = [(chunk.message_start_time, chunk.message_end_time) for chunk in many]
    assert kept.time_span_ns == (min(first for first, _ in times), max(last for _, last in times))


def test_an_hour_of_chunks_takes_less_than_a_megabyte():
    kept = ChunkList()
    tracemalloc.start()
    for k in range(CHUNKS_PER_HOUR):
        start = 48_000 * k
        offsets = {channel: start + 47_000 + channel for channel in range(2, 5)}
        kept.append(ChunkIndex(47_000, start, "zstd", 46_000, k + 250_000_000, 5_000, offsets, k, 90_000))
    grown = tracemalloc.get_traced_memory()[0]
    tracemalloc.stop()
    assert grown < GROWTH_MAX
