"""Memory that processes share: a mailbox for the newest value, a ring for all values in their order. Nobody ever waits.

One process writes, others read. A count is written after the value that it counts. On x86 a reader sees them in that
order, and what it copied is checked against the count again; a processor that reorders stores (Arm) needs a barrier
that Python does not have.
"""

from dataclasses import dataclass
from multiprocessing.shared_memory import SharedMemory

import numpy as np

SLOTS = 4
"""Of a mailbox: the newest value stays untouched while so many less one newer ones are written."""

RETRIES = 8
"""Of a read that newer values overtook; a reader that is so slow takes the next tick's value."""

_HEAD = np.dtype([("written", "<u8"), ("acknowledged", "<u8"), ("lost", "<u8")])


@dataclass
class _Block:
    """A head and rows of one type in shared memory."""

    memory: SharedMemory
    head: np.ndarray
    rows: np.ndarray

    @classmethod
    def of(cls, row: np.dtype, count: int, name: str | None) -> "_Block":
        """A new block, or the one of this name.

        Raises:
            FileNotFoundError: There is none of this name.
        """
        size = _HEAD.itemsize + count * row.itemsize
        memory = SharedMemory(name, create=name is None, size=size if name is None else 0)
        head = np.ndarray(1, _HEAD, memory.buf)
        rows = np.ndarray(count, row, memory.buf, _HEAD.itemsize)
        if name is None:
            head[:] = 0
            rows.view(np.uint8)[:] = 0
        return cls(memory, head, rows)

    def close(self, *, forget: bool) -> None:
        """Let go of the memory; the one who made it forgets it too."""
        del self.head, self.rows
        self.memory.close()
        if forget:
            self.memory.unlink()


class Mailbox:
    """The newest value of one writer, for any number of readers."""

    def __init__(self, value: np.dtype, name: str | None = None):
        """Make one, or open that of this name in another process.

        Args:
            value: Type of a value.
            name: Of one that exists; see `name`.

        Raises:
            FileNotFoundError: There is none of this name.
        """
        row = np.dtype([("begun", "<u8"), ("value", value), ("done", "<u8")], align=True)
        self._is_maker = name is None
        self._block = _Block.of(row, SLOTS, name)

    @property
    def name(self) -> str:
        """By which another process opens it."""
        return self._block.memory.name

    @property
    def count(self) -> int:
        """How many values there have been."""
        return int(self._block.head["written"][0])

    def write(self, value: np.void | np.ndarray | np.generic) -> None:
        """Put a value in; the one before is gone."""
        count = self.count + 1
        slot = self._block.rows[count % SLOTS : count % SLOTS + 1]
        slot["begun"] = count
        slot["value"] = value
        slot["done"] = count
        self._block.head["written"] = count

    def read(self) -> tuple[int, np.void] | None:
        """How many values there have been, and a copy of the newest; None before the first one."""
        for _ in range(RETRIES):
            count = self.count
            if count == 0:
                return None
            slot = self._block.rows[count % SLOTS]
            # In this order: a writer that is in it has begun before, and is done after.
            done = int(slot["done"])
            value = slot["value"].copy()
            if int(slot["begun"]) == count == done:
                return count, value
        return None

    def close(self) -> None:
        """Let go of it; its maker's value is then gone for all."""
        self._block.close(forget=self._is_maker)


class Ring:
    """Values of one writer in their order, for one reader who takes them and says when they are safe.

    A writer that finds no room leaves the value out and counts it: control never waits for a disk.
    """

    def __init__(self, value: np.dtype, capacity: int, name: str | None = None):
        """Make one, or open that of this name in another process.

        Args:
            value: Type of a value.
            capacity: Values that may be taken and not acknowledged, or not taken, at a time.
            name: Of one that exists; see `name`.

        Raises:
            FileNotFoundError: There is none of this name.
        """
        self._is_maker, self._capacity = name is None, capacity
        self._block = _Block.of(value, capacity, name)
        self._taken = self.acknowledged

    @property
    def name(self) -> str:
        """By which another process opens it."""
        return self._block.memory.name

    @property
    def written(self) -> int:
        """Values that were put in."""
        return int(self._block.head["written"][0])

    @property
    def acknowledged(self) -> int:
        """Values that are safe with the reader; whoever reads after it goes on from there."""
        return int(self._block.head["acknowledged"][0])

    @property
    def lost(self) -> int:
        """Values that found no room."""
        return int(self._block.head["lost"][0])

    def put(self, value: np.void | np.ndarray) -> bool:
        """Whether there was room."""
        count = self.written
        if count - self.acknowledged >= self._capacity:
            self._block.head["lost"] += 1
            return False
        self._block.rows[count % self._capacity] = value
        self._block.head["written"] = count + 1
        return True

    @property
    def room(self) -> int:
        """Values that can be put in now."""
        return self._capacity - (self.written - self.acknowledged)

    def take(self, most: int | None = None) -> np.ndarray:
        """Copies of the values that are new since the last take; of the oldest, so many at most."""
        until = self.written if most is None else min(self.written, self._taken + most)
        index = np.arange(self._taken, until) % self._capacity
        self._taken = until
        return self._block.rows[index]

    def newest(self) -> tuple[int, np.void] | None:
        """How many values there have been, and a copy of the newest; None before the first one. Takes nothing."""
        count = self.written
        return None if count == 0 else (count, self._block.rows[(count - 1) % self._capacity].copy())

    def acknowledge(self, count: int) -> None:
        """Say that so many values, from the first one on, are safe: their places may be used again."""
        self._block.head["acknowledged"] = count

    def close(self) -> None:
        """Let go of it; its maker's values are then gone for all."""
        self._block.close(forget=self._is_maker)
