"""Where the pages are served: on this computer alone, or, with a certificate, in the laboratory's network."""

import contextlib
import os
import socket
import tempfile
import webbrowser
from collections.abc import Callable, Iterator
from pathlib import Path

import uvicorn

from exograv.errors import ConfigError, ExogravError

from .hub import Hub
from .keys import SESSION_S, Role
from .limits import MESSAGE_MAX_BYTES
from .options import Address
from .server import application

LOOPBACK = "127.0.0.1"
WAITING = 64
END_S = 3
"""In which pages have to let go when the server ends [s]."""

Say = Callable[[str], None]


@contextlib.contextmanager
def bound(address: Address) -> Iterator[tuple[socket.socket, str]]:
    """The socket, and host with port by which it is reached.

    Raises:
        ConfigError: The port is not to be had.
    """
    address.check()
    host = address.lan or LOOPBACK
    try:
        family, *_, place = socket.getaddrinfo(host, address.port, type=socket.SOCK_STREAM)[0]
        listening = socket.socket(family, socket.SOCK_STREAM)
    except OSError as error:
        raise ConfigError(f"--lan '{host}' is no address of this computer: {error.strerror}.") from error
    with listening:
        try:
            listening.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            listening.bind(place)
            # Now, so that a browser which is quicker than the server waits instead of being refused.
            listening.listen(WAITING)
        except OSError as error:
            raise ConfigError(
                f"Port {address.port} of {host} cannot be had: {error.strerror}. Give another --port, or end the "
                "program that has it."
            ) from error
        name = f"[{host}]" if ":" in host else host
        yield listening, f"{name}:{listening.getsockname()[1]}"


def settings_of(hub: Hub, address: Address, host: str) -> uvicorn.Config:
    """Of the server that serves it."""
    port = host.rpartition(":")[2]
    hosts = [host] if address.lan is not None else [host, f"localhost:{port}"]
    return uvicorn.Config(
        application(hub, address.scheme, hosts),
        ws="websockets-sansio",
        ws_max_size=MESSAGE_MAX_BYTES,
        # One compressed message can cost a thousand times its size.
        ws_per_message_deflate=False,
        ssl_certfile=address.certificate,
        ssl_keyfile=address.key,
        log_level="warning",
        access_log=False,
        server_header=False,
        timeout_graceful_shutdown=END_S,
        # No proxy stands in front: headers that say who asks are not believed.
        proxy_headers=False,
        h11_max_incomplete_event_size=MESSAGE_MAX_BYTES,
    )


def serve(hub: Hub, address: Address, listening: socket.socket, host: str, say: Say) -> None:
    """Until Ctrl-C. The link is said once; whoever has it first is the operator.

    Raises:
        ExogravError: Something in here failed; whatever the machine carries is let down by its guard.
    """
    server = uvicorn.Server(settings_of(hub, address, host))
    hub.on_failure = lambda: setattr(server, "should_exit", True)
    link = f"{hub.origin}/#{hub.keys.token(Role.OPERATOR, SESSION_S)}"
    say(f"Open this link once, as the operator: {link}")
    with _opened(link) if address.browser else contextlib.nullcontext(), contextlib.suppress(KeyboardInterrupt):
        server.run(sockets=[listening])
    if hub.failure is not None:
        raise ExogravError(
            f"The console ended by a mistake of its own: {hub.failure!r}. The machine's guard lets the arm down by "
            "itself. Please report this with the last lines of the diary."
        ) from hub.failure


@contextlib.contextmanager
def _opened(link: str) -> Iterator[None]:
    """In a browser, by a file that only its owner can read: what a program is started with everybody can see."""
    with tempfile.TemporaryDirectory(prefix="exograv-console-") as folder:
        path = Path(folder) / "open.html"
        with os.fdopen(os.open(path, os.O_WRONLY | os.O_CREAT, 0o600), "w", encoding="utf-8") as file:
            file.write(f'<!doctype html><meta http-equiv="refresh" content="0; url={link}"><title>exograv</title>\n')
        webbrowser.open(path.as_uri())
        yield
