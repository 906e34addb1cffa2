"""A chunk that unpacks to more than a writer makes is damage: nothing of it is unpacked."""

import tracemalloc
import zlib

import pytest
import zstandard
from mcap.records import Chunk

from exograv.recording.contents import UNPACKED_BYTES_MAX, DamageError, _unpacked


def chunk(size: int) -> Chunk:
    data, crc = zstandard.ZstdCompressor().compress(bytes(size)), zlib.crc32(bytes(size))
    return Chunk("zstd", data, 0, 0, crc, size)


def test_a_chunk_of_the_usual_size_is_unpacked():
    assert _unpacked(chunk(1_000_000)) == bytes(1_000_000)


def test_a_small_chunk_that_unpacks_to_much_takes_no_memory():
    bomb = chunk(4 * UNPACKED_BYTES_MAX)
    assert len(bomb.data) < 100_000
    tracemalloc.start()
    with pytest.raises(DamageError):
        _unpacked(bomb)
    assert tracemalloc.get_traced_memory()[1] < 1_000_000
    tracemalloc.stop()
