"""Door of the server: it accepts connections at a limited rate, and keeps only a few before their login.

A flood of connections therefore takes neither the descriptors of the process nor the time of its event loop.

- A connection costs little until the head of its first request has arrived. Beyond the limit the oldest is closed.
- The door closes a connection whose first bytes are no HTTP, without an answer. With TLS it looks for the whole first
  message of a handshake.
- A request with the cookie of a login, or with a correct link, does not wait behind other requests.
"""

import asyncio
import contextlib
import re
import socket
import ssl
import sys
import typing
from collections import deque
from collections.abc import Callable, Iterator
from typing import Any

from .keys import PageSession, Role

ACCEPTED_AT_ONCE, BEGUN_AT_ONCE, PAUSE_S = 32, 2, 0.01
"""Largest number of connections that are accepted, and of those that are handed to the server, in `PAUSE_S` [s]."""

SILENT_MAX, SILENT_OF_ADDRESS = 64, 32
"""Largest number of connections without a whole request, in all and from one address. A browser opens six at a time."""

ASKERS_MAX, ASKERS_OF_ADDRESS = 96, 48
"""Largest number of connections with a request and without a login."""

CONNECTIONS_OF_ROLE = {Role.OPERATOR: 24, Role.THERAPIST: 12, Role.PARTICIPANT: 16, Role.VIEWER: 24}
"""Largest number of connections with a login, by role: three browsers for a viewer and an operator."""

REQUEST_S = 5.0
"""Time-out for the TLS handshake and the head of the first request [s]."""

NEWCOMER_S = 20.0
"""Longest life of a connection without a login [s]. A slow tablet loads the largest file of a page in this time."""

SWEEP_S = 0.5
"""Period in which connections are checked for these times [s]."""

LOOK_AGAIN_S = 0.005
"""Time between two looks at a head that is not whole [s]."""

HEAD_BYTES = 4096
"""Length from which a head is handed to the server although its end has not arrived [byte]."""

HELLO_HEAD_BYTES = 5
"""Length of the head of a TLS record [byte]."""

FIRST_LINE = re.compile(rb"(GET|HEAD|POST) /[!-~]* HTTP/1\.1\r\n")
"""Pattern of the first line of a request; the server answers no other requests."""

HELLO = re.compile(rb"\x16\x03[\x00-\x04](..)", re.DOTALL)
"""Head of a TLS record with a handshake; its length in two bytes."""

LOGIN = re.compile(rb"POST /enter .*\r\ncontent-length: *(\d{1,4})\r\n", re.DOTALL | re.IGNORECASE)
"""Request with the token of a link; its body is awaited, too."""


@typing.runtime_checkable
class Recognition(typing.Protocol):
    """Check of the first request of a connection, as its bytes have come from the network."""

    def login_of_head(self, head: bytes) -> PageSession | None:
        """Return the login of a request; None without one."""
        ...

    def has_token(self, body: bytes) -> bool:
        """Return True if the body of a request holds the token of a valid link."""
        ...


Protocol = Callable[[dict[str, Any]], asyncio.Protocol]
"""Function that makes the protocol of a connection; it puts the given values into the state of each request."""

VISIT = "visit"
"""Name of the `Visit` in the state of a request."""


class Visit:
    """Connection of a client."""

    def __init__(self, door: "Door", client: socket.socket, address: str, begun: float):
        """Begin at the time `begun` of the event loop [s], without a login."""
        self._door, self.client, self.address, self.begun = door, client, address, begun
        self.session: PageSession | None = None
        """Login of the first request with a valid cookie."""

        self.has_asked = False
        """True if a request has arrived in the application."""

        self.transport: asyncio.Transport | None = None
        self.task: asyncio.Task[None] | None = None

    @property
    def is_over(self) -> bool:
        """True if the connection is closed."""
        if self.transport is not None:
            return self.transport.is_closing()
        return self.client.fileno() == -1

    def close(self) -> None:
        """Close the connection at once, if it is open."""
        if self.is_over:
            return
        if self.transport is not None:
            self.transport.abort()
        elif self.task is not None:
            self.task.cancel()  # the handshake goes on; its end closes the socket
        else:
            self._door.unwatch(self)
            self.client.close()

    def know(self, session: PageSession) -> bool:
        """Take the login of a request; return False if its role has too many connections."""
        return self.session is not None or self._door.know(self, session)


class _Crowd:
    """Connections of one kind by address, with limits."""

    def __init__(self, most: int, most_of_address: int):
        self._most, self._most_of_address = most, most_of_address
        self._at = dict[str, dict[Visit, None]]()

    def __iter__(self) -> Iterator[Visit]:
        return iter([visit for visits in self._at.values() for visit in visits])

    def add(self, visit: Visit) -> None:
        self._at.setdefault(visit.address, {})[visit] = None

    def discard(self, visit: Visit) -> None:
        visits = self._at.get(visit.address, {})
        visits.pop(visit, None)
        if not visits:
            self._at.pop(visit.address, None)

    def crowded(self, address: str) -> list[Visit]:
        """Return the connections of which one must go before another comes from the address; none if there is room.

        They are those of the address, or of the address with most; the oldest is first.
        """
        for visit in [visit for visit in self._at.get(address, ()) if visit.is_over]:
            self.discard(visit)
        here = self._at.get(address, {})
        if len(here) >= self._most_of_address:
            return list(here)
        return list(max(self._at.values(), key=len)) if sum(map(len, self._at.values())) >= self._most else []


class _Lane:
    """Connections that wait for their turn to be handed to the server."""

    def __init__(self, begin: Callable[[Visit], None]):
        self._begin, self._waiting, self._has_come = begin, deque[Visit](), asyncio.Event()

    def add(self, visit: Visit) -> None:
        self._waiting.append(visit)
        self._has_come.set()

    async def go_on(self) -> None:
        loop = asyncio.get_running_loop()
        while True:
            until = loop.time() + PAUSE_S
            for _ in range(BEGUN_AT_ONCE):
                while not self._waiting:
                    self._has_come.clear()
                    await self._has_come.wait()
                visit = self._waiting.popleft()
                if not visit.is_over:
                    self._begin(visit)
            await asyncio.sleep(max(until - loop.time(), 0.0))


class Door:
    """Accept loop in place of that of `asyncio`. It has the methods of `asyncio.Server` that uvicorn calls."""

    def __init__(
        self,
        listening: socket.socket,
        protocol: Protocol,
        tls: ssl.SSLContext | None,
        known: Recognition,
        fail: Callable[[Exception], object],
    ):
        """Accept connections on `listening` from now on, in the running event loop.

        `fail` is called with an error after which no connection is accepted any more.
        """
        self._listening, self._protocol, self._tls, self._recognition = listening, protocol, tls, known
        self._loop = asyncio.get_running_loop()
        self._silent = _Crowd(SILENT_MAX, SILENT_OF_ADDRESS)
        self._askers = _Crowd(ASKERS_MAX, ASKERS_OF_ADDRESS)
        self._known = {role: set[Visit]() for role in Role}
        self._strangers, self._friends = _Lane(self._begin), _Lane(self._begin)
        listening.setblocking(False)
        works = (self._accept_all(), self._strangers.go_on(), self._friends.go_on(), self._sweep_all())
        self._fail = fail
        self._tasks = [self._loop.create_task(work) for work in works]
        for task in self._tasks:
            task.add_done_callback(self._ended)

    def close(self) -> None:
        """Accept no more connections, and close those that the server has not got."""
        for task in self._tasks:
            task.cancel()
        for visit in [*self._silent, *self._askers, *(visit for known in self._known.values() for visit in known)]:
            if visit.task is None:
                visit.close()

    async def wait_closed(self) -> None:
        """Wait until no more connections are accepted."""
        await asyncio.gather(*self._tasks, return_exceptions=True)

    def know(self, visit: Visit, session: PageSession) -> bool:
        """Count a connection to its role; return False if the role has too many."""
        known = self._known[session.role]
        known -= {each for each in known if each.is_over}
        if len(known) >= CONNECTIONS_OF_ROLE[session.role]:
            return False
        self._silent.discard(visit)
        self._askers.discard(visit)
        visit.session = session
        known.add(visit)
        return True

    def unwatch(self, visit: Visit) -> None:
        """Wait for no more bytes of a connection that the server has not got."""
        if sys.platform != "win32":
            self._loop.remove_reader(visit.client)

    async def _accept_all(self) -> None:
        while True:
            until = self._loop.time() + PAUSE_S
            for _ in range(ACCEPTED_AT_ONCE):
                try:
                    client, address = await self._loop.sock_accept(self._listening)
                except OSError:
                    break  # the client has gone, or the process has no descriptor: try again after the pause
                self._receive(client, str(address[0]))
            await asyncio.sleep(max(until - self._loop.time(), 0.0))

    def _ended(self, task: asyncio.Task[None]) -> None:
        error = None if task.cancelled() else task.exception()
        if isinstance(error, Exception):
            self._fail(error)

    def _receive(self, client: socket.socket, address: str) -> None:
        if crowd := self._silent.crowded(address):
            crowd[0].close()
            self._silent.discard(crowd[0])
        visit = Visit(self, client, address, self._loop.time())
        self._silent.add(visit)
        if sys.platform == "win32":
            self._speak(visit)  # its event loop cannot wait for a byte without reading it
        else:
            self._look(visit)

    def _look(self, visit: Visit) -> None:
        """Look at the first request, and leave it for the server."""
        if visit.is_over:
            return
        self.unwatch(visit)
        try:
            seen = visit.client.recv(HEAD_BYTES, socket.MSG_PEEK)
        except BlockingIOError:
            self._loop.add_reader(visit.client, self._look, visit)
            return
        except OSError:
            seen = b""
        if self._tls is not None:
            self._look_at_hello(visit, seen)
            return
        head, end, body = seen.partition(b"\r\n\r\n")
        login = LOGIN.match(head + b"\r\n") if end else None
        is_whole = bool(end) and (login is None or len(body) >= int(login[1]))
        if seen and not is_whole and len(seen) < HEAD_BYTES:
            self._loop.call_later(LOOK_AGAIN_S, self._look, visit)
        elif not FIRST_LINE.match(head + b"\r\n"):
            visit.close()
        elif (session := self._recognition.login_of_head(head)) is not None and self.know(visit, session):
            self._friends.add(visit)
        elif login is not None and self._recognition.has_token(body):
            self._silent.discard(visit)
            self._askers.add(visit)
            self._friends.add(visit)
        else:
            self._speak(visit)

    def _look_at_hello(self, visit: Visit, seen: bytes) -> None:
        """Leave a connection for the server when the first message of its handshake is whole."""
        hello = HELLO.match(seen)
        if not seen or (hello is None and len(seen) >= HELLO_HEAD_BYTES):
            visit.close()
        elif hello is None or len(seen) < min(HELLO_HEAD_BYTES + int.from_bytes(hello[1]), HEAD_BYTES):
            self._loop.call_later(LOOK_AGAIN_S, self._look, visit)
        else:
            self._speak(visit)

    def _speak(self, visit: Visit) -> None:
        """Take a connection without a login that asks for something."""
        self._silent.discard(visit)
        if crowd := self._askers.crowded(visit.address):
            half = next((each for each in crowd if each.transport is not None and not each.has_asked), None)
            if half is None:
                visit.close()
                return
            half.close()
            self._askers.discard(half)
        self._askers.add(visit)
        self._strangers.add(visit)

    def _begin(self, visit: Visit) -> None:
        visit.task = self._loop.create_task(self._connect(visit))

    async def _connect(self, visit: Visit) -> None:
        within_s = None if self._tls is None else REQUEST_S
        try:
            # A handshake that fails or is late needs no message: `asyncio` has closed the connection.
            with contextlib.suppress(OSError):
                visit.transport, _ = await self._loop.connect_accepted_socket(
                    lambda: self._protocol({VISIT: visit}), visit.client, ssl=self._tls, ssl_handshake_timeout=within_s
                )
        finally:
            if visit.transport is None:
                visit.client.close()

    async def _sweep_all(self) -> None:
        while True:
            await asyncio.sleep(SWEEP_S)
            now = self._loop.time()
            for crowd in (self._silent, self._askers):
                for visit in crowd:
                    if now - visit.begun > (NEWCOMER_S if visit.has_asked else REQUEST_S):
                        visit.close()
                    if visit.is_over:
                        crowd.discard(visit)
