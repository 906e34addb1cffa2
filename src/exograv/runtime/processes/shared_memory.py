"""Shared memory of processes: a mailbox for the newest value, rings for values and messages. No process waits.

One process writes, others read. A count is written after the value that it counts. On x86 a reader sees them in that
order, and checks its copy against the count again. A processor that reorders stores (Arm) would need a barrier, which
Python does not have.
"""

import pickle
import zlib
from dataclasses import dataclass
from multiprocessing.shared_memory import SharedMemory
from typing import Any, NamedTuple

import numpy as np

from exograv.errors import RigError

from .spawn import start_resource_tracker

SLOTS = 4
"""Number of slots of a mailbox; the newest value stays unchanged until `SLOTS` − 1 newer ones are written."""

RETRIES = 8
"""Number of retries of a read that newer values overtook; a slower reader takes the value of the next tick."""

_HEAD = np.dtype([("written", "<u8"), ("acknowledged", "<u8"), ("lost", "<u8")])


class MemoryPlaces(NamedTuple):
    """Addresses and sizes of a mailbox or a ring in this process, for code in C. They end with `close`."""

    head: int
    rows: int
    stride: int
    """Distance of two rows [byte]."""
    capacity: int
    """Number of rows."""
    value_at: int
    """Offset of the value in its row [byte]."""
    value_bytes: int
    done_at: int
    """Offset of the word that a mailbox writes last [byte]; 0 in a ring."""


@dataclass
class _Block:
    """Head and rows of one type in shared memory."""

    memory: SharedMemory
    head: np.ndarray
    rows: np.ndarray

    @classmethod
    def of(cls, row: np.dtype, count: int, name: str | None, *, is_lazy: bool = False) -> "_Block":
        """Create a block, or open the one with this name; `is_lazy` as in `Ring`.

        Raises:
            FileNotFoundError: There is no block with this name.
        """
        start_resource_tracker()
        size = _HEAD.itemsize + count * row.itemsize
        memory = SharedMemory(name, create=name is None, size=size if name is None else 0)
        head = np.ndarray(1, _HEAD, memory.buf)
        rows = np.ndarray(count, row, memory.buf, _HEAD.itemsize)
        if name is None:
            head[:] = 0
            if not is_lazy:  # new memory is zero; to write it makes the system provide it
                rows.view(np.uint8)[:] = 0
        return cls(memory, head, rows)

    def places(self) -> MemoryPlaces:
        """Return where the block lies."""
        fields = self.rows.dtype.fields or {}
        value, value_at = fields["value"][:2] if "begun" in fields else (self.rows.dtype, 0)
        done_at = fields["done"][1] if "begun" in fields else 0
        stride, count = self.rows.dtype.itemsize, len(self.rows)
        return MemoryPlaces(
            self.head.ctypes.data, self.rows.ctypes.data, stride, count, value_at, value.itemsize, done_at
        )

    def close(self, *, forget: bool) -> None:
        """Release the memory; its creator also deletes it."""
        del self.head, self.rows
        self.memory.close()
        if forget:
            self.memory.unlink()


class Mailbox:
    """Newest value of one writer, for any number of readers."""

    def __init__(self, value: np.dtype, name: str | None = None):
        """Create a mailbox, or open the one with this name.

        Args:
            value: Type of a value.
            name: Name of an existing mailbox; see `name`.

        Raises:
            FileNotFoundError: There is no mailbox with this name.
        """
        row = np.dtype([("begun", "<u8"), ("value", value), ("done", "<u8")], align=True)
        self._is_maker = name is None
        self._block = _Block.of(row, SLOTS, name)

    @property
    def name(self) -> str:
        """Name by which another process opens the mailbox."""
        return self._block.memory.name

    def places(self) -> MemoryPlaces:
        """Return where the mailbox lies in this process."""
        return self._block.places()

    @property
    def count(self) -> int:
        """Number of values written so far."""
        return int(self._block.head["written"][0])

    def write(self, value: np.void | np.ndarray | np.generic) -> None:
        """Write a value in place of the one before."""
        count = self.count + 1
        slot = self._block.rows[count % SLOTS : count % SLOTS + 1]
        slot["begun"] = count
        slot["value"] = value
        slot["done"] = count
        self._block.head["written"] = count

    def read(self) -> tuple[int, np.void] | None:
        """Return the number of values so far, and a copy of the newest; None before the first one."""
        for _ in range(RETRIES):
            count = self.count
            if count == 0:
                return None
            slot = self._block.rows[count % SLOTS]
            # This order is essential: a writer within the slot has changed `begun` first, and changes `done` last.
            done = int(slot["done"])
            value = slot["value"].copy()
            if int(slot["begun"]) == count == done:
                return count, value
        return None

    def close(self) -> None:
        """Release the mailbox; if its creator does so, the value is gone for all."""
        self._block.close(forget=self._is_maker)


class Ring:
    """Values of one writer in order, for one reader that takes and acknowledges them.

    A writer that finds no room drops the value and counts it: control never waits for a disk.
    """

    def __init__(self, value: np.dtype, capacity: int, name: str | None = None, *, is_lazy: bool = False):
        """Create a ring, or open the one with this name.

        Args:
            value: Type of a value.
            capacity: Number of values that fit without an acknowledgement.
            name: Name of an existing ring; see `name`.
            is_lazy: True if the system need not provide the memory before it is used.

        Raises:
            FileNotFoundError: There is no ring with this name.
        """
        self._is_maker, self._capacity = name is None, capacity
        self._block = _Block.of(value, capacity, name, is_lazy=is_lazy)
        self._taken = self.acknowledged

    @property
    def name(self) -> str:
        """Name by which another process opens the ring."""
        return self._block.memory.name

    def places(self) -> MemoryPlaces:
        """Return where the ring lies in this process."""
        return self._block.places()

    @property
    def written(self) -> int:
        """Number of values written so far."""
        return int(self._block.head["written"][0])

    @property
    def acknowledged(self) -> int:
        """Number of values that are safe with the reader; a later reader continues from there."""
        return int(self._block.head["acknowledged"][0])

    @property
    def lost(self) -> int:
        """Number of values that found no room."""
        return int(self._block.head["lost"][0])

    def put(self, value: np.void | np.ndarray) -> bool:
        """Write a value; return True if there was room."""
        count = self.written
        if count - self.acknowledged >= self._capacity:
            self._block.head["lost"] += 1
            return False
        self._block.rows[count % self._capacity] = value
        self._block.head["written"] = count + 1
        return True

    @property
    def room(self) -> int:
        """Number of values that can be written now."""
        return self._capacity - (self.written - self.acknowledged)

    def take(self, most: int | None = None) -> np.ndarray:
        """Return copies of the values since the last take, oldest first, at most `most` of them.

        A reader that does not acknowledge may be overtaken: it continues with the oldest value that is still there.
        """
        written = self.written
        first = max(self._taken, written - self._capacity)
        until = written if most is None else min(written, first + most)
        # Counts of damaged memory may exceed an index of NumPy, so only the places are arrays.
        index = (first % self._capacity + np.arange(max(until - first, 0))) % self._capacity
        self._taken = until
        return self._block.rows[index]

    def newest(self) -> tuple[int, np.void] | None:
        """Return the number of values so far, and a copy of the newest, not taken; None before the first one."""
        count = self.written
        return None if count == 0 else (count, self._block.rows[(count - 1) % self._capacity].copy())

    def acknowledge(self, count: int) -> None:
        """Acknowledge the first `count` values: their slots may be used again."""
        self._block.head["acknowledged"] = count

    def close(self) -> None:
        """Release the ring; if its creator does so, the values are gone for all."""
        self._block.close(forget=self._is_maker)


PART_BYTES = 4096 - 16
"""Bytes of a message in one slot of a message ring."""

PARTS = 512
"""Slots of a message ring: 2 MB, four times the limits of a person on nine joints."""

_PART = np.dtype([("size", "<u8"), ("crc", "<u8"), ("data", "V", PART_BYTES)])


class MessageRing:
    """Messages of one writer in order, for one reader: pickled objects or plain bytes, one kind per ring.

    Neither process ever waits for the other.

    A message takes as many slots as it needs. They count only when all of them are written, so the reader never meets a
    part of a message, even if the writer dies while it writes. A check sum (CRC-32) keeps damaged bytes from `pickle`,
    which could execute them.
    """

    def __init__(self, name: str | None = None):
        """Create a ring, or open the one with this name.

        Raises:
            FileNotFoundError: There is no ring with this name.
        """
        self._is_maker = name is None
        self._block = _Block.of(_PART, PARTS, name)

    @property
    def name(self) -> str:
        """Name by which another process opens the ring."""
        return self._block.memory.name

    def put(self, message: object) -> bool:
        """Write an object; return False if there is no room, because the reader has not taken the last messages."""
        return self.put_bytes(pickle.dumps(message))

    def put_bytes(self, data: bytes) -> bool:
        """Write at least one byte; return False if there is no room."""
        head = self._block.head
        written, parts = int(head["written"][0]), -(-len(data) // PART_BYTES)
        if written + parts - int(head["acknowledged"][0]) > PARTS:
            head["lost"] += 1
            return False
        crc = zlib.crc32(data)
        for k in range(parts):
            part = data[k * PART_BYTES : (k + 1) * PART_BYTES].ljust(PART_BYTES, b"\0")
            self._block.rows[(written + k) % PARTS] = (len(data), crc, part)
        head["written"] = written + parts
        return True

    def take(self) -> Any:
        """Return the oldest object, and free its slots; None if there is none. Only for a writer that is trusted.

        Raises:
            RigError: As `take_bytes`.
        """
        data = self.take_bytes()
        return None if data is None else pickle.loads(data)

    def take_bytes(self) -> bytes | None:
        """Return the bytes of the oldest message, and free its slots; None if there is none.

        Raises:
            RigError: The memory does not hold a whole message, or its check sum is wrong.
        """
        head = self._block.head[0]
        taken, waiting = int(head["acknowledged"]), int(head["written"]) - int(head["acknowledged"])
        if waiting == 0:
            return None
        size = int(self._block.rows[taken % PARTS]["size"])
        parts = -(-size // PART_BYTES)
        if not 0 < parts <= waiting <= PARTS:
            raise RigError(f"A message of {size} bytes takes {parts} slots, and {waiting} of {PARTS} are written.")
        rows = self._block.rows[(taken % PARTS + np.arange(parts)) % PARTS]
        data = np.ascontiguousarray(rows["data"]).tobytes()[:size]
        if zlib.crc32(data) != int(rows["crc"][0]):
            raise RigError(f"A message of {size} bytes has a wrong check sum: the shared memory was overwritten.")
        self._block.head["acknowledged"] = taken + parts
        return data

    def close(self) -> None:
        """Release the ring; if its creator does so, the messages are gone for both."""
        self._block.close(forget=self._is_maker)
