"""Door of the server: it accepts connections at a limited rate, and keeps only a few before their login.

A flood of connections therefore takes neither the descriptors of the process nor the time of its event loop. A
connection costs little until the head of its first request has arrived. Beyond the limit the oldest connection without
one is closed, not the newest: a page of ours sends its request at once, and is then known by its cookie.
"""

import asyncio
import contextlib
import socket
import ssl
import sys
from collections import deque
from collections.abc import Callable
from typing import Any

from .keys import PageSession, Role

ACCEPTED_AT_ONCE, BEGUN_AT_ONCE, PAUSE_S = 64, 8, 0.02
"""Largest number of connections that are accepted, and of those that are handed to the server, in `PAUSE_S` [s]."""

NEWCOMERS_MAX, NEWCOMERS_PER_ADDRESS = 96, 48
"""Largest number of connections without a login, in all and from one address. A browser opens six at a time."""

CONNECTIONS_OF_ROLE = {Role.OPERATOR: 24, Role.THERAPIST: 12, Role.PARTICIPANT: 16, Role.VIEWER: 24}
"""Largest number of connections with a login, by role: three browsers for a viewer and an operator."""

REQUEST_S = 5.0
"""Time-out for the TLS handshake and the head of the first request [s]."""

NEWCOMER_S = 20.0
"""Longest life of a connection without a login [s]. A slow tablet loads the largest file of a page in this time."""

SWEEP_S = 0.5
"""Period in which connections are checked for these times [s]."""

LOOK_AGAIN_S = 0.05
"""Time between two looks at a head that is not whole [s]."""

HEAD_BYTES, END_OF_HEAD = 4096, b"\r\n\r\n"
"""Length from which a head is handed to the server although its end has not arrived [byte]."""

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

        self.has_spoken = self.has_asked = False
        """True if a request has arrived at the door (with TLS: its first byte), and in the application."""

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


class Door:
    """Accept loop in place of that of `asyncio`. It has the methods of `asyncio.Server` that uvicorn calls."""

    def __init__(self, listening: socket.socket, protocol: Protocol, tls: ssl.SSLContext | None):
        """Accept connections on `listening` from now on, in the running event loop."""
        self._listening, self._protocol, self._tls = listening, protocol, tls
        self._loop = asyncio.get_running_loop()
        self._newcomers = dict[str, dict[Visit, None]]()
        self._known = {role: set[Visit]() for role in Role}
        self._spoken, self._has_spoken = deque[Visit](), asyncio.Event()
        listening.setblocking(False)
        works = (self._accept_all(), self._begin_all(), self._sweep_all())
        self._tasks = [self._loop.create_task(work) for work in works]

    def close(self) -> None:
        """Accept no more connections, and close those that have not spoken."""
        for task in self._tasks:
            task.cancel()
        for visit in [visit for visits in self._newcomers.values() for visit in visits if visit.task is None]:
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
        self._forget(visit)
        visit.session = session
        known.add(visit)
        return True

    def unwatch(self, visit: Visit) -> None:
        """Do not wait for the first byte of a connection any more."""
        if sys.platform != "win32" and not visit.has_spoken:
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

    def _receive(self, client: socket.socket, address: str) -> None:
        if not self._has_room(address):
            client.close()
            return
        visit = Visit(self, client, address, self._loop.time())
        self._newcomers.setdefault(address, {})[visit] = None
        self._watch(visit)

    def _watch(self, visit: Visit) -> None:
        if visit.is_over:
            return
        if sys.platform == "win32":
            self._speak(visit)  # its event loop cannot wait for a byte without reading it
        else:
            self._loop.add_reader(visit.client, self._look, visit)

    def _look(self, visit: Visit) -> None:
        """Look at the bytes of a connection, and leave them for the server."""
        self.unwatch(visit)
        try:
            head = visit.client.recv(HEAD_BYTES, socket.MSG_PEEK)
        except OSError:
            head = b""
        if not head:
            visit.close()
        elif self._tls is None and END_OF_HEAD not in head and len(head) < HEAD_BYTES:
            self._loop.call_later(LOOK_AGAIN_S, self._watch, visit)
        else:
            self._speak(visit)

    def _speak(self, visit: Visit) -> None:
        """Hand a connection to the server, when its turn comes."""
        visit.has_spoken = True
        self._spoken.append(visit)
        self._has_spoken.set()

    async def _begin_all(self) -> None:
        while True:
            until = self._loop.time() + PAUSE_S
            for _ in range(BEGUN_AT_ONCE):
                while not self._spoken:
                    self._has_spoken.clear()
                    await self._has_spoken.wait()
                visit = self._spoken.popleft()
                if not visit.is_over:
                    visit.task = self._loop.create_task(self._connect(visit))
            await asyncio.sleep(max(until - self._loop.time(), 0.0))

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

    def _has_room(self, address: str) -> bool:
        """Return True if another connection may come from the address. The oldest one without a request may go."""
        for visit in [visit for visit in self._newcomers.get(address, ()) if visit.is_over]:
            self._forget(visit)
        if len(self._newcomers.get(address, ())) < NEWCOMERS_PER_ADDRESS:
            if sum(map(len, self._newcomers.values())) < NEWCOMERS_MAX:
                return True
            address = max(self._newcomers, key=lambda each: len(self._newcomers[each]))
        silent = (visit for visit in self._newcomers[address] if not visit.has_spoken)
        half = (visit for visit in self._newcomers[address] if visit.transport is not None and not visit.has_asked)
        oldest = next(silent, None) or next(half, None)
        if oldest is None:
            return False
        oldest.close()
        self._forget(oldest)
        return True

    def _forget(self, visit: Visit) -> None:
        visits = self._newcomers.get(visit.address, {})
        visits.pop(visit, None)
        if not visits:
            self._newcomers.pop(visit.address, None)

    async def _sweep_all(self) -> None:
        while True:
            await asyncio.sleep(SWEEP_S)
            now = self._loop.time()
            for visit in [visit for visits in self._newcomers.values() for visit in visits]:
                if now - visit.begun > (NEWCOMER_S if visit.has_asked else REQUEST_S):
                    visit.close()
                if visit.is_over:
                    self._forget(visit)
