"""Lines of text between two processes on this computer, over a TCP connection that never blocks."""

import contextlib
import select
import socket
import time
from types import TracebackType

from exograv.errors import RigError

HERE = "127.0.0.1"

LINE_MAX_BYTES = 65_536
"""Largest length of a line. A longer one ends the connection, so that no process fills the other one's memory."""

CONNECT_S = 10.0
"""Time-out for the other process to listen [s]."""


class Lines:
    """Connection that sends and receives whole lines."""

    def __init__(self, opened: socket.socket):
        """Take over a connected socket."""
        opened.setblocking(False)
        opened.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        self._socket, self._begun = opened, b""
        self.is_open = True
        """False after the other process has closed the connection."""

    def send(self, line: str) -> None:
        """Send a line. A line that finds no reader ends the connection."""
        if not self.is_open:
            return
        try:
            self._socket.sendall(line.encode() + b"\n")
        except OSError:  # closed, or the buffer is full because the other process does not read
            self.close()

    def received(self, patience_s: float = 0.0) -> list[str]:
        """Return the lines that have arrived; wait for the first one for at most `patience_s` [s]."""
        if patience_s and self.is_open:
            select.select((self._socket,), (), (), patience_s)
        while self.is_open:
            try:
                data = self._socket.recv(LINE_MAX_BYTES)
            except BlockingIOError:
                break
            except OSError:
                data = b""
            self._begun += data
            if not data or len(self._begun.rpartition(b"\n")[2]) > LINE_MAX_BYTES:
                self.close()
        *lines, self._begun = self._begun.split(b"\n")
        return [line.decode(errors="replace") for line in lines]

    def close(self) -> None:
        """Close the connection; nothing is sent or received any more."""
        self.is_open = False
        self._socket.close()

    def __enter__(self) -> "Lines":
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Close the connection at the end of the block."""
        self.close()


class LinesListener:
    """Listener for one connection after another."""

    def __init__(self, port: int):
        """Listen at this port of this computer; 0 takes a free one.

        Raises:
            RigError: Another process listens there.
        """
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_STREAM)
        self._socket.setblocking(False)
        try:
            self._socket.bind((HERE, port))
        except OSError as error:
            self._socket.close()
            raise RigError(
                f"Port {port} of this computer cannot be listened at: {error.strerror}. Give a free port."
            ) from error
        self._socket.listen(1)

    @property
    def port(self) -> int:
        """Port of the listener."""
        return int(self._socket.getsockname()[1])

    def accepted(self) -> Lines | None:
        """Return a new connection, if there is one."""
        with contextlib.suppress(BlockingIOError):
            return Lines(self._socket.accept()[0])
        return None

    def close(self) -> None:
        """Close the listener; connections stay open."""
        self._socket.close()


def connected_lines(port: int) -> Lines:
    """Connect to the listener at this port.

    Raises:
        RigError: No process listens there.
    """
    until = time.monotonic() + CONNECT_S
    while True:
        try:
            return Lines(socket.create_connection((HERE, port), timeout=CONNECT_S))
        except OSError as error:
            if time.monotonic() > until:
                raise RigError(f"No process listens at port {port} of this computer.") from error
            time.sleep(0.02)
