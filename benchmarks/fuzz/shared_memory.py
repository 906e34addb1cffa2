"""Readers of shared memory that was overwritten: only a `RigError` is allowed.

The first byte of an input chooses the reader. The rest is combined (exclusive or) with memory of ordinary content: a
zero leaves a byte as it is. Atheris sees the numbers that are compared and would forge check sums, which no damage
does; so the check sum here also depends on the input.
"""

import atexit
import contextlib
import zlib
from types import SimpleNamespace
from typing import Any

import numpy as np

from exograv.errors import RigError
from exograv.runtime.processes import shared_memory
from exograv.runtime.processes.shared_memory import Mailbox, MessageRing, Ring

VALUE = np.dtype([("sequence", "<u8"), ("q", "<f8", (3,))])
CAPACITY = 8
MESSAGES = (1, "a word", bytes(5000))

_READERS = (Mailbox(VALUE), Ring(VALUE, CAPACITY), MessageRing())
for _reader in _READERS:
    atexit.register(_reader.close)


def seeds() -> list[bytes]:
    """Return an input without a change for each reader, and one that changes each byte of the counts."""
    return [bytes([k]) + change for k in range(len(_READERS)) for change in (bytes(64), b"\x01" * 40)]


def read(data: bytes) -> None:
    """Overwrite the memory of a reader, and read it until it is empty or an error ends it."""
    kind, change = (data[0] if data else 0) % len(_READERS), data[1:]
    reader, salt = _READERS[kind], zlib.crc32(data)
    buffer: Any = reader._block.memory.buf
    memory = np.frombuffer(buffer, np.uint8)
    touched = memory[: len(change)]
    module: Any = shared_memory
    module.zlib = SimpleNamespace(crc32=lambda content: zlib.crc32(content, salt))
    try:
        reader._block.head[:] = 0
        _write(reader)
        touched ^= np.frombuffer(change, np.uint8)[: len(touched)]
        _take_all(reader)
    finally:
        touched[:] = 0
        module.zlib = zlib


def _write(writer: Mailbox | Ring | MessageRing) -> None:
    """Write ordinary content."""
    if isinstance(writer, MessageRing):
        for message in MESSAGES:
            writer.put(message)
        return
    put = writer.write if isinstance(writer, Mailbox) else writer.put
    for _ in range(3):
        put(np.ones((), VALUE))


def _take_all(reader: Mailbox | Ring | MessageRing) -> None:
    with contextlib.suppress(RigError):
        if isinstance(reader, Mailbox):
            reader.read()
        elif isinstance(reader, Ring):
            reader._taken = reader.acknowledged  # as a reader that is started now
            reader.take()
            reader.newest()
        else:
            while (message := reader.take()) is not None:
                assert message in MESSAGES
