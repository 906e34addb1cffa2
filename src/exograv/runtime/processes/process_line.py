"""Parent's end of the line to a child process: neither reading nor writing waits for the child.

`Connection.recv` waits for the rest of a message that has begun, and `Connection.send` waits for a reader. A child that
hangs in the middle of a message, or that reads nothing, would thereby stop its parent, and the guard lowers the arm if
the parent is silent.
"""

import contextlib
import os
import pickle
import struct
import sys
import threading
import time
from collections.abc import Iterator
from multiprocessing.connection import Connection, wait
from multiprocessing.reduction import ForkingPickler
from typing import Any

PART_BYTES = 65_536
"""Size of one read or write [byte]."""

LOOK_BYTES = 4_000_000
"""Largest number of bytes that are read in one look [byte]. A child that floods its line must not keep its parent."""

UNSENT_MAX_BYTES = 64_000_000
"""Largest number of bytes that wait for a child that does not read [byte]. Further messages are lost."""

WORD_MAX_BYTES = 2_000_000_000
"""Largest length of a message [byte]. A longer one counts as a broken connection."""

SLICE_S = 0.02
"""Time between two attempts to send the rest of a message while the parent waits [s]."""


class BrokenLineError(OSError):
    """The child has sent bytes that are no message."""


class ProcessLine:
    """Line to a child process, whose end is an ordinary `Connection`. Several threads may send."""

    def __init__(self, connection: Connection):
        """Take over the connection; no other code may read from it or write to it."""
        self._connection, self._came, self._unsent = connection, bytearray(), bytearray()
        self._sending, self._is_closed, self.has_ended = threading.Lock(), False, False
        # Pipes of Windows carry whole messages, and cannot be read without waiting in this way.
        self._waits = sys.platform == "win32"
        if not self._waits:
            os.set_blocking(connection.fileno(), False)

    def send(self, word: object) -> None:
        """Send a message, or keep what the child cannot take now for `flush`.

        Raises:
            OSError: The child has closed its end.
        """
        if self._waits:
            self._connection.send(word)
            return
        data = bytes(ForkingPickler.dumps(word))
        head = struct.pack("!i", len(data)) if len(data) <= 0x7FFFFFFF else struct.pack("!iQ", -1, len(data))
        with self._sending:
            if len(self._unsent) + len(data) > UNSENT_MAX_BYTES:
                return
            self._unsent += head + data
            self._write()

    @property
    def has_unsent(self) -> bool:
        """True if the child has not taken all messages yet."""
        return bool(self._unsent)

    def flush(self) -> None:
        """Send as many waiting messages as the child can take now."""
        with self._sending, contextlib.suppress(OSError):
            self._write()

    def words(self) -> Iterator[Any]:
        """Yield the whole messages that have arrived, at most about `LOOK_BYTES`.

        Raises:
            EOFError: The child has closed its end, and no whole message is left.
            OSError: The line is broken.
        """
        if self._waits:
            while self._connection.poll():
                yield self._connection.recv()
            return
        self.flush()
        self._read()
        while (data := self._whole()) is not None:
            yield _word(data)
        if self.has_ended:
            raise EOFError

    def next_word(self, within_s: float) -> Any:
        """Return the next message; None if no whole message arrives in this time.

        Raises:
            EOFError: The child has closed its end, and no whole message is left.
            OSError: The line is broken.
        """
        if self._waits:
            return self._connection.recv() if self._connection.poll(within_s) else None
        until, data = time.monotonic() + within_s, self._whole()
        while data is None and not self.has_ended:
            self.flush()
            left_s = until - time.monotonic()
            wait([self._connection], max(min(left_s, SLICE_S) if self._unsent else left_s, 0.0))
            self._read()
            data = self._whole()
            if left_s <= 0.0:
                break
        if data is None and self.has_ended:
            raise EOFError
        return None if data is None else _word(data)

    def close(self) -> None:
        """Close the line. Messages that wait are lost."""
        with self._sending:
            self._is_closed = True
            self._connection.close()

    def _write(self) -> None:
        while self._unsent and not self._is_closed:
            try:
                sent = os.write(self._connection.fileno(), self._unsent[:PART_BYTES])
            except BlockingIOError:
                return
            except OSError:
                self._unsent.clear()
                raise
            del self._unsent[:sent]

    def _read(self) -> None:
        """Read all waiting bytes."""
        most = LOOK_BYTES
        while most > 0 and not self.has_ended:
            try:
                data = os.read(self._connection.fileno(), PART_BYTES)
            except BlockingIOError:
                return
            except OSError:  # the child was killed with messages unread
                data = b""
            self.has_ended = not data
            self._came += data
            most -= len(data)

    def _whole(self) -> bytes | None:
        """Take the oldest whole message; None if there is none."""
        came, begin = self._came, 4
        if len(came) < begin:
            return None
        (length,) = struct.unpack_from("!i", came)
        if length == -1:
            begin = 12
            if len(came) < begin:
                return None
            (length,) = struct.unpack_from("!Q", came, 4)
        if not 0 < length <= WORD_MAX_BYTES:
            raise BrokenLineError(f"A message of {length} bytes was announced")
        if len(came) < begin + length:
            return None
        data = bytes(came[begin : begin + length])
        del came[: begin + length]
        return data


def _word(data: bytes) -> Any:
    """Read a message.

    Raises:
        BrokenLineError: The bytes are no message.
    """
    try:
        return pickle.loads(data)
    except Exception as error:
        raise BrokenLineError(f"A message cannot be read: {error!r}") from error
