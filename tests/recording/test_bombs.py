"""Content that asks for more memory than a writer's file needs is damage: nothing of it is unpacked."""

import struct
import tracemalloc
import zlib

import pytest
import zstandard
from mcap.records import Chunk

from exograv.recording.contents import UNPACKED_BYTES_MAX, DamageError, _unpacked
from exograv.recording.tick_columns import unpack


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


@pytest.mark.parametrize("head", [(2**32 - 1, 2, 4), (10, 2**32 - 1, 4), (2**32 - 1, 2**32 - 1, 2**32 - 1), (1, 1, 0)])
def test_columns_that_announce_more_ticks_or_joints_than_they_have_take_no_memory(head: tuple[int, int, int]):
    tracemalloc.start()
    with pytest.raises(ValueError, match=r"do not have|cannot have"):
        unpack(struct.pack("<III", *head) + bytes(100_000))
    assert tracemalloc.get_traced_memory()[1] < 1_000_000
    tracemalloc.stop()
