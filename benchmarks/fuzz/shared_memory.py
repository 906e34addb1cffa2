"""Readers of shared memory, on any content of that memory: only a `RigError` is allowed."""

import contextlib

import numpy as np

from exograv.errors import RigError
from exograv.runtime.processes.shared_memory import Mailbox, MessageRing, Ring

VALUE = np.dtype([("sequence", "<u8"), ("q", "<f8", (3,))])
CAPACITY = 8

_READERS = (Mailbox(VALUE), Ring(VALUE, CAPACITY), MessageRing())


def seeds() -> list[bytes]:
    """Return the memory of each kind with ordinary content."""
    box, ring, messages = Mailbox(VALUE), Ring(VALUE, CAPACITY), MessageRing()
    with contextlib.closing(box), contextlib.closing(ring), contextlib.closing(messages):
        for _ in range(3):
            box.write(np.ones((), VALUE))
            ring.put(np.ones((), VALUE))
        for message in (1, "a word", {"level": 0.5}, bytes(5000)):
            messages.put(message)
        kinds = enumerate((box, ring, messages))
        return [bytes([k]) + bytes(one._block.memory.buf[:20_000]) for k, one in kinds]


def read(data: bytes) -> None:
    """Put the data into the memory of one reader, and read it until it is empty or an error ends it."""
    reader = _READERS[data[0] % len(_READERS)] if data else _READERS[0]
    memory = reader._block.memory.buf
    content = data[1 : 1 + len(memory)]
    memory[: len(content)] = content
    try:
        _take_all(reader)
    finally:
        memory[: len(content)] = bytes(len(content))


def _take_all(reader: Mailbox | Ring | MessageRing) -> None:
    with contextlib.suppress(RigError):
        if isinstance(reader, Mailbox):
            reader.read()
        elif isinstance(reader, Ring):
            reader._taken = reader.acknowledged  # as a reader that is started now
            reader.take()
            reader.newest()
        else:
            while reader.take() is not None:
                pass
