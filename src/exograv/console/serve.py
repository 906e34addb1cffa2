"""Server of the pages: on this computer only, or in the laboratory's network with a certificate."""

import asyncio
import contextlib
import socket
from collections.abc import Generator, Iterator
from typing import Any

import uvicorn
from uvicorn.config import STARTUP_FAILURE
from websockets.exceptions import InvalidState

from exograv.errors import ConfigError

from .door import Door
from .hub import Hub
from .limits import MESSAGE_MAX_BYTES
from .line_protocol import RECEIVE_BYTES, LineProtocol
from .log_limit import limited_logs
from .options import Address
from .server import application
from .turnstile import Admission

LOOPBACK = "127.0.0.1"
WAITING = 4096
"""Largest number of connections that wait to be accepted, as far as the system allows. A page waits behind a flood."""

END_S = 3
"""Time in which the pages must close their connections when the server ends [s]."""

FAREWELL_S = 0.1
"""Time in which the lines send the last message, so that every page says at once that the session has ended [s]."""

LINE_CLOSES_S = 0.1
"""Time between two attempts to close the lines [s]."""


@contextlib.contextmanager
def bound(address: Address) -> Iterator[tuple[socket.socket, str]]:
    """Bind a socket; yield the socket and its host with port.

    Raises:
        ConfigError: The address or the port cannot be used.
    """
    address.check()
    host = address.lan or LOOPBACK
    try:
        family, *_, place = socket.getaddrinfo(host, address.port, type=socket.SOCK_STREAM)[0]
        # With the protocol named, asyncio switches off Nagle's algorithm: it delays answers by up to 40 ms.
        listening = socket.socket(family, socket.SOCK_STREAM, socket.IPPROTO_TCP)
    except OSError as error:
        raise ConfigError(f"--lan '{host}' is not an address of this computer: {error.strerror}.") from error
    with listening:
        try:
            listening.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            listening.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, RECEIVE_BYTES)
            listening.bind(place)
            # Listen now: a browser that is faster than the server then waits instead of being refused.
            listening.listen(WAITING)
        except OSError as error:
            raise ConfigError(
                f"Port {address.port} of {host} cannot be used: {error.strerror}. Give another --port, or end the "
                "program that uses it."
            ) from error
        name = f"[{host}]" if ":" in host else host
        yield listening, f"{name}:{listening.getsockname()[1]}"


def settings_of(hub: Hub, address: Address, host: str) -> uvicorn.Config:
    """Return the settings of the web server."""
    port = host.rpartition(":")[2]
    hosts = [host] if address.lan is not None else [host, f"localhost:{port}"]
    return uvicorn.Config(
        application(hub, address.scheme, hosts),
        http="h11",
        ws=LineProtocol,
        ws_max_size=MESSAGE_MAX_BYTES,
        # Without compression: a compressed message can expand to a thousand times its size.
        ws_per_message_deflate=False,
        ssl_certfile=address.certificate,
        ssl_keyfile=address.key,
        log_level="warning",
        access_log=False,
        server_header=False,
        timeout_graceful_shutdown=END_S,
        # There is no proxy: headers that name the client are not trusted.
        proxy_headers=False,
        h11_max_incomplete_event_size=MESSAGE_MAX_BYTES,
    )


class PageServer(uvicorn.Server):
    """Server behind the door with its limits. It also shuts down correctly while a page closes its connection.

    uvicorn sends a close frame on every connection. The package `websockets` rejects this frame if the connection is
    already closing; `shutdown` then tries again.
    """

    def __init__(self, config: uvicorn.Config, hub: Hub):
        """Serve the pages of this hub."""
        super().__init__(config)
        self._hub = hub
        self.says_farewell = True
        """True if the pages are told at the end that the session has ended."""

    @contextlib.contextmanager
    def capture_signals(self) -> Generator[None, None, None]:
        """Leave all signals as they are: the parent process ends the server."""
        yield

    async def serve(self, sockets: list[socket.socket] | None = None) -> None:
        """Serve the pages, with a limited log, until `should_exit` is set."""
        asyncio.get_running_loop().set_exception_handler(self._look_at_error)
        with limited_logs():
            await super().serve(sockets)

    def _look_at_error(self, loop: asyncio.AbstractEventLoop, context: dict[str, Any]) -> None:
        """End a process that has no memory left: it goes on to ask the desk, but no page reaches it any more."""
        if isinstance(error := context.get("exception"), MemoryError):
            self._hub.fail(error)
        loop.default_exception_handler(context)

    async def startup(self, sockets: list[socket.socket] | None = None) -> None:
        """Start the application, and accept connections through the door."""
        await self.lifespan.startup()
        if self.lifespan.should_exit:
            raise SystemExit(STARTUP_FAILURE)

        def protocol(state: dict[str, Any]) -> asyncio.Protocol:
            make: Any = self.config.http_protocol_class
            return make(config=self.config, server_state=self.server_state, app_state={**self.lifespan.state, **state})

        admission = Admission(self._hub.keys, self._hub.origin.rpartition(":")[2])
        doors: list[Any] = [Door(each, protocol, self.config.ssl, admission, self._hub.fail) for each in sockets or []]
        self.servers = doors
        self.started = True

    async def shutdown(self, sockets: list[socket.socket] | None = None) -> None:
        """Say goodbye, close all lines and end the server; lines that close are awaited for up to `END_S`."""
        if self.says_farewell:
            # The guard lowers the arm now. The clock must not close an open window as complete meanwhile.
            if self._hub.trial is not None:
                self._hub.trial.interrupt(self._hub.desk.now(), "The session has ended.")
            self._hub.farewell()
            await asyncio.sleep(FAREWELL_S)
        for _ in range(round(END_S / LINE_CLOSES_S)):
            with contextlib.suppress(InvalidState):
                await super().shutdown(sockets)
                return
            await asyncio.sleep(LINE_CLOSES_S)
