"""Door of the server: it accepts connections at a limited rate, and keeps only a few before their login.

A flood of connections therefore takes neither the descriptors of the process nor the time of its event loop. Beyond the
limit the oldest connection without a login is closed, not the newest: a page of ours sends its request at once, and is
then known by its cookie.
"""

import asyncio
import contextlib
import socket
import ssl
from collections.abc import Callable
from typing import Any

from .keys import PageSession, Role

ACCEPTED_AT_ONCE, ACCEPT_PAUSE_S = 8, 0.02
"""Largest number of connections that are accepted in this time [s]: 400 per second. Others wait in the kernel."""

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

Protocol = Callable[[dict[str, Any]], asyncio.Protocol]
"""Function that makes the protocol of a connection; it puts the given values into the state of each request."""

VISIT = "visit"
"""Name of the `Visit` in the state of a request."""


class Visit:
    """One connection."""

    def __init__(self, door: "Door", address: str, begun: float):
        """Begin at the time `begun` of the event loop [s], without a login."""
        self._door, self.address, self.begun = door, address, begun
        self.session: PageSession | None = None
        """Login of the first request with a valid cookie."""

        self.has_asked = False
        """True if a whole head of a request has arrived."""

        self.transport: asyncio.Transport | None = None
        self.task: asyncio.Task[None] | None = None

    @property
    def is_over(self) -> bool:
        """True if the connection is closed."""
        if self.transport is None:
            return self.task is not None and self.task.done()
        return self.transport.is_closing()

    def close(self) -> None:
        """Close the connection at once."""
        if self.transport is not None:
            self.transport.abort()
        elif self.task is not None:
            self.task.cancel()

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
        listening.setblocking(False)
        self._tasks = [self._loop.create_task(work) for work in (self._accept_all(), self._sweep_all())]

    def close(self) -> None:
        """Accept no more connections."""
        for task in self._tasks:
            task.cancel()

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

    async def _accept_all(self) -> None:
        while True:
            until = self._loop.time() + ACCEPT_PAUSE_S
            for _ in range(ACCEPTED_AT_ONCE):
                try:
                    client, address = await self._loop.sock_accept(self._listening)
                except OSError:
                    break  # the client has gone, or the process has no descriptor: try again after the pause
                self._receive(client, str(address[0]))
            await asyncio.sleep(max(until - self._loop.time(), 0.0))

    def _receive(self, client: socket.socket, address: str) -> None:
        self._make_room(address)
        visit = Visit(self, address, self._loop.time())
        self._newcomers.setdefault(address, {})[visit] = None
        visit.task = self._loop.create_task(self._connect(visit, client))

    async def _connect(self, visit: Visit, client: socket.socket) -> None:
        within_s = None if self._tls is None else REQUEST_S
        try:
            # A handshake that fails or is late needs no message: `asyncio` has closed the connection.
            with contextlib.suppress(OSError):
                visit.transport, _ = await self._loop.connect_accepted_socket(
                    lambda: self._protocol({VISIT: visit}), client, ssl=self._tls, ssl_handshake_timeout=within_s
                )
        finally:
            if visit.transport is None:
                client.close()

    def _make_room(self, address: str) -> None:
        """Close the oldest connection without a login, of this address or of that with most, if there are too many."""
        for visit in [visit for visit in self._newcomers.get(address, ()) if visit.is_over]:
            self._forget(visit)
        if len(self._newcomers.get(address, ())) < NEWCOMERS_PER_ADDRESS:
            if sum(map(len, self._newcomers.values())) < NEWCOMERS_MAX:
                return
            address = max(self._newcomers, key=lambda each: len(self._newcomers[each]))
        oldest = next(iter(self._newcomers[address]))
        oldest.close()
        self._forget(oldest)

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
