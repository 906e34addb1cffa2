"""Another process reads complete values, the newest or all in order; a writer never waits, and counts lost values."""

import contextlib
import ctypes
import multiprocessing
import os
import pickle
import signal
from collections.abc import Callable, Iterator

import numpy as np
import pytest

from exograv.errors import RigError
from exograv.runtime.processes.shared_memory import PART_BYTES, PARTS, SLOTS, Mailbox, MessageRing, Ring

VALUE = np.dtype([("sequence", "<u8"), ("q", "<f8", (7,))])
CAPACITY = 32
MANY = 20_000


def value(k: int) -> np.ndarray:
    one = np.zeros((), VALUE)
    one["sequence"], one["q"] = k, k
    return one


@pytest.fixture
def mailbox():
    box = Mailbox(VALUE)
    yield box
    box.close()


@pytest.fixture
def ring():
    one = Ring(VALUE, CAPACITY)
    yield one
    one.close()


def test_an_empty_mailbox_has_nothing_to_read(mailbox: Mailbox):
    assert mailbox.read() is None


def test_a_mailbox_has_the_newest_value_and_counts(mailbox: Mailbox):
    for k in range(1, 3 * SLOTS):
        mailbox.write(value(k))
        found = mailbox.read()
        assert found is not None
        assert found[0] == k
        assert found[1]["sequence"] == k
        assert (found[1]["q"] == k).all()


def test_a_value_that_was_read_does_not_change_with_the_next_one(mailbox: Mailbox):
    mailbox.write(value(1))
    found = mailbox.read()
    for k in range(2, 2 + SLOTS):
        mailbox.write(value(k))
    assert found is not None
    assert (found[1]["q"] == 1).all()


def test_a_value_that_is_being_written_is_not_read(mailbox: Mailbox):
    mailbox.write(value(1))
    mailbox._block.rows[1 % SLOTS]["begun"] = 1 + SLOTS
    assert mailbox.read() is None


def _write(name: str, many: int) -> None:
    box = Mailbox(VALUE, name)
    for k in range(1, many + 1):
        box.write(value(k))
    box.close()


def test_across_processes_no_value_is_torn_and_none_is_older_than_the_one_before(mailbox: Mailbox):
    writer = multiprocessing.get_context("spawn").Process(target=_write, args=(mailbox.name, MANY))
    writer.start()
    newest = 0
    while newest < MANY:
        found = mailbox.read()
        if found is None:
            continue
        assert (found[1]["q"] == found[1]["sequence"]).all()
        assert found[0] >= newest
        newest = found[0]
    writer.join()
    assert writer.exitcode == 0


def test_a_ring_gives_all_values_in_order(ring: Ring):
    taken: list[int] = []
    for k in range(5 * CAPACITY):
        assert ring.put(value(k))
        if k % 7 == 0:
            taken += ring.take()["sequence"].tolist()
            ring.acknowledge(len(taken))
    taken += ring.take()["sequence"].tolist()
    assert taken == list(range(5 * CAPACITY))
    assert ring.lost == 0


def test_a_lazy_ring_is_as_empty_as_another_one_and_gives_all_values_in_order():
    with contextlib.closing(Ring(np.dtype("<i8"), 4, is_lazy=True)) as lazy:
        assert lazy.take().tolist() == []
        for value in (3, 1, 2):
            lazy.put(np.array(value))
        assert lazy.take().tolist() == [3, 1, 2]


def test_a_full_ring_counts_dropped_values_and_keeps_its_own(ring: Ring):
    room = [ring.put(value(k)) for k in range(CAPACITY + 5)]
    assert room == [True] * CAPACITY + [False] * 5
    assert ring.lost == 5
    assert ring.take()["sequence"].tolist() == list(range(CAPACITY))
    # A value that was taken is not safe yet: its slot is free only after the acknowledgement.
    assert not ring.put(value(99))
    ring.acknowledge(CAPACITY)
    assert ring.put(value(100))


def test_a_reader_that_was_overtaken_gets_each_value_that_is_still_there_once(ring: Ring):
    watcher = Ring(VALUE, CAPACITY, ring.name)
    for k in range(3 * CAPACITY):
        ring.put(value(k))
        ring.acknowledge(k)
    assert watcher.take()["sequence"].tolist() == list(range(2 * CAPACITY, 3 * CAPACITY))
    assert len(watcher.take()) == 0
    watcher.close()


@pytest.mark.parametrize("count", [2**40, 2**62, 2**64 - 1])
def test_a_damaged_count_of_a_ring_asks_for_no_more_rows_than_the_ring_has(ring: Ring, count: int):
    ring._block.head["written"] = count
    assert len(ring.take()) == CAPACITY


def test_a_damaged_count_below_the_values_taken_gives_none(ring: Ring):
    ring._taken, ring._block.head["written"] = 2**63, 0
    assert len(ring.take()) == 0


def _take_and_die(name: str, acknowledged: int) -> None:
    one = Ring(VALUE, CAPACITY, name)
    one.take()
    one.acknowledge(acknowledged)
    os.kill(os.getpid(), signal.SIGKILL)


def test_after_a_reader_was_killed_the_next_one_continues_after_the_acknowledged_values(ring: Ring):
    for k in range(20):
        ring.put(value(k))
    reader = multiprocessing.get_context("spawn").Process(target=_take_and_die, args=(ring.name, 12))
    reader.start()
    reader.join()
    assert reader.exitcode == -signal.SIGKILL
    again = Ring(VALUE, CAPACITY, ring.name)
    assert again.take()["sequence"].tolist() == list(range(12, 20))
    again.close()
    assert ring.put(value(20))


def test_memory_that_does_not_exist_is_not_made_by_its_reader():
    with pytest.raises(FileNotFoundError):
        Mailbox(VALUE, "exograv-nobody")
    with pytest.raises(FileNotFoundError):
        Ring(VALUE, CAPACITY, "exograv-nobody")


@pytest.fixture
def ends() -> Iterator[tuple[MessageRing, MessageRing]]:
    with contextlib.closing(MessageRing()) as writer, contextlib.closing(MessageRing(writer.name)) as reader:
        yield writer, reader


def test_messages_of_any_size_arrive_in_order(ends: tuple[MessageRing, MessageRing]):
    writer, reader = ends
    sizes = [0, 1, PART_BYTES - 100, PART_BYTES, PART_BYTES + 1, 40 * PART_BYTES]
    for _ in range(20):  # around the end of the ring several times
        for size in sizes:
            assert writer.put(os.urandom(1)[:1] * size)
        assert [len(reader.take()) for _ in sizes] == sizes
    assert reader.take() is None


def test_a_message_without_room_is_refused_whole_and_the_others_stay(ends: tuple[MessageRing, MessageRing]):
    writer, reader = ends
    assert writer.put(1)
    assert not writer.put(bytes(PARTS * PART_BYTES))
    assert writer.put(2)
    assert [reader.take(), reader.take(), reader.take()] == [1, 2, None]


@pytest.mark.parametrize("size", [0, 2 * PART_BYTES, 2**63])
def test_a_size_that_the_memory_cannot_hold_is_an_error_and_no_wait(ends: tuple[MessageRing, MessageRing], size: int):
    writer, reader = ends
    writer.put("word")
    writer._block.rows["size"][0] = size
    with pytest.raises(RigError, match=f"of {size} bytes"):
        reader.take()


def test_a_message_of_a_writer_that_dies_within_it_is_never_seen(ends: tuple[MessageRing, MessageRing]):
    writer, reader = ends
    writer._block.rows[0] = (3 * PART_BYTES, 0, b"\1" * PART_BYTES)  # the first of three slots, and no count
    assert reader.take() is None


class _Executed:
    """Object whose pickle executes code when it is loaded."""

    def __reduce__(self):
        return pytest.fail, ("pickle has executed a message of damaged memory",)


def test_damaged_bytes_of_a_message_never_reach_pickle(ends: tuple[MessageRing, MessageRing]):
    writer, reader = ends
    writer.put(bytes(1000))
    writer._block.rows["data"][0] = pickle.dumps(_Executed()).ljust(PART_BYTES, b"\0")
    with pytest.raises(RigError, match="wrong check sum"):
        reader.take()


@pytest.mark.parametrize("taken", [2**63 - 1, 2**64 - 2])
def test_a_damaged_count_of_messages_is_an_error_of_the_rig(ends: tuple[MessageRing, MessageRing], taken: int):
    writer, reader = ends
    writer.put("word")
    writer._block.head["acknowledged"], writer._block.head["written"] = taken, taken + 1
    with pytest.raises(RigError):
        reader.take()


MAKERS: list[Callable[[str | None], Mailbox | Ring | MessageRing]] = [
    lambda name: Mailbox(VALUE, name),
    lambda name: Ring(VALUE, CAPACITY, name),
    MessageRing,
]


@pytest.mark.parametrize("make", MAKERS, ids=["mailbox", "ring", "messages"])
def test_memory_lives_until_its_maker_closes_it_and_no_reader_ends_it(make: Callable):
    made = make(None)
    for _ in range(2):
        make(made.name).close()
    name = made.name
    made.close()
    with pytest.raises(FileNotFoundError):
        make(name)


@pytest.mark.parametrize("make", [Mailbox, lambda value: Ring(value, CAPACITY)], ids=["mailbox", "ring"])
def test_code_in_c_finds_counts_and_values_at_the_places_of_the_memory(make: Callable):
    with contextlib.closing(make(VALUE)) as memory:
        places, is_ring = memory.places(), isinstance(memory, Ring)
        assert places.value_bytes == VALUE.itemsize
        assert places.capacity == (CAPACITY if is_ring else SLOTS)
        for k in range(1, 4):
            (memory.put if is_ring else memory.write)(value(k))
            row = places.rows + places.stride * (k - 1 if is_ring else k % SLOTS)
            there = np.frombuffer(ctypes.string_at(row + places.value_at, places.value_bytes), VALUE)[0]
            assert there["sequence"] == k
            assert (there["q"] == k).all()
            assert ctypes.c_uint64.from_address(places.head).value == k
            if not is_ring:
                assert ctypes.c_uint64.from_address(row + places.done_at).value == k
        assert is_ring == (places.done_at == 0)


def test_room_lost_and_newest_of_a_ring_follow_what_is_written_and_acknowledged(ring: Ring):
    assert (ring.newest(), ring.room, ring.lost) == (None, CAPACITY, 0)
    for k in range(CAPACITY + 3):
        assert ring.put(value(k)) == (k < CAPACITY)
    assert (ring.room, ring.lost, ring.written) == (0, 3, CAPACITY)
    ring.acknowledge(5)
    assert (ring.room, ring.acknowledged) == (5, 5)
    assert ring.put(value(77))
    newest = ring.newest()
    assert newest is not None
    assert newest[0] == CAPACITY + 1
    assert newest[1]["sequence"] == 77


def test_a_reader_takes_at_most_as_many_as_it_asks_for_and_each_once(ring: Ring):
    for k in range(10):
        ring.put(value(k))
    assert [one["sequence"] for one in ring.take(4)] == [0, 1, 2, 3]
    assert [one["sequence"] for one in ring.take(0)] == []
    assert [one["sequence"] for one in ring.take(100)] == [4, 5, 6, 7, 8, 9]
    assert len(ring.take()) == 0


@pytest.mark.parametrize("size", [1, PART_BYTES - 1, PART_BYTES, PART_BYTES + 1, 3 * PART_BYTES])
def test_bytes_of_a_message_arrive_as_they_were_sent_at_each_place_of_the_ring(size: int):
    with contextlib.closing(MessageRing()) as ours, contextlib.closing(MessageRing(ours.name)) as theirs:
        parts = -(-size // PART_BYTES)
        for k in range(2 * PARTS // parts):
            data = bytes([k % 256]) * size
            assert ours.put_bytes(data)
            assert theirs.take_bytes() == data
        assert theirs.take_bytes() is None
        for _ in range(PARTS // parts):
            assert ours.put_bytes(b"x" * size)
        assert not ours.put_bytes(b"x" * (size if PARTS % parts == 0 else PARTS * PART_BYTES))
