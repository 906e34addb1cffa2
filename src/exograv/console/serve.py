"""Server of the pages: on this computer only, or in the laboratory's network with a certificate."""

import asyncio
import contextlib
import os
import socket
import tempfile
import webbrowser
from collections.abc import Callable, Iterator
from pathlib import Path
from types import FrameType

import uvicorn
from websockets.exceptions import InvalidState

from exograv.errors import ConfigError, ExogravError

from .hub import Hub
from .keys import SESSION_S, Role
from .limits import MESSAGE_MAX_BYTES
from .options import Address
from .server import application

LOOPBACK = "127.0.0.1"
WAITING = 64
"""Largest number of connections that wait to be accepted."""

END_S = 3
"""Time in which the pages must close their connections when the server ends [s]."""

FAREWELL_S = 0.1
"""Time in which the lines send the last message, so that every page says at once that the session has ended [s]."""

LINE_CLOSES_S = 0.1
"""Time between two attempts to close the lines [s]."""

Say = Callable[[str], None]
"""Function that shows a line to the operator."""


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
        listening = socket.socket(family, socket.SOCK_STREAM)
    except OSError as error:
        raise ConfigError(f"--lan '{host}' is not an address of this computer: {error.strerror}.") from error
    with listening:
        try:
            listening.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
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
        ws="websockets-sansio",
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
    """Server that also shuts down correctly while a page closes its connection.

    uvicorn sends a close frame on every connection. The package `websockets` rejects this frame if the connection is
    already closing; `shutdown` then tries again.
    """

    def __init__(self, config: uvicorn.Config, hub: Hub):
        """Serve the pages of this hub."""
        super().__init__(config)
        self._hub = hub

    def handle_exit(self, sig: int, frame: FrameType | None) -> None:
        """End the server softly, also when the signal comes twice.

        A shell or `uv run` passes on a Ctrl-C that the terminal has sent already. uvicorn would then leave out the end
        of the application and print a traceback. The time of our end is limited anyway.
        """
        super().handle_exit(sig, frame)
        self.force_exit = False

    async def shutdown(self, sockets: list[socket.socket] | None = None) -> None:
        """Say goodbye, close all lines and end the server; lines that close are awaited for up to `END_S`."""
        self._hub.farewell()
        await asyncio.sleep(FAREWELL_S)
        for _ in range(round(END_S / LINE_CLOSES_S)):
            with contextlib.suppress(InvalidState):
                await super().shutdown(sockets)
                return
            await asyncio.sleep(LINE_CLOSES_S)


def serve(hub: Hub, address: Address, listening: socket.socket, host: str, say: Say) -> None:
    """Serve the pages until Ctrl-C. The link is shown once; the first person who opens it is the operator.

    Raises:
        ExogravError: The console failed. The guard of the machine lowers the arm.
    """
    server = PageServer(settings_of(hub, address, host), hub)
    hub.on_failure = lambda: setattr(server, "should_exit", True)
    link = f"{hub.origin}/#{hub.keys.token(Role.OPERATOR, SESSION_S)}"
    say(f"Open this link once, as the operator: {link}")
    with _opened(link) if address.browser else contextlib.nullcontext(), contextlib.suppress(KeyboardInterrupt):
        server.run(sockets=[listening])
    if hub.failure is not None:
        raise ExogravError(
            f"The console ended by a programming error: {hub.failure!r}. The guard of the machine lowers the arm by "
            "itself. Please report this with the last lines of the diary."
        ) from hub.failure


@contextlib.contextmanager
def _opened(link: str) -> Iterator[None]:
    """Open the link in a browser by a file that only its owner can read: program arguments are visible to all users."""
    with tempfile.TemporaryDirectory(prefix="exograv-console-") as folder:
        path = Path(folder) / "open.html"
        with os.fdopen(os.open(path, os.O_WRONLY | os.O_CREAT, 0o600), "w", encoding="utf-8") as file:
            file.write(f'<!doctype html><meta http-equiv="refresh" content="0; url={link}"><title>exograv</title>\n')
        webbrowser.open(path.as_uri())
        yield
