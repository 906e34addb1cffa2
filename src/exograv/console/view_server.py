"""Server of one page for this computer only, without the packages of the console."""

import contextlib
import webbrowser
from collections.abc import Callable, Iterator
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import PurePosixPath

from exograv.errors import ConfigError

from .page_files import SAID_WITH_EVERYTHING, TYPES, page_files

LOOPBACK = "127.0.0.1"


@contextlib.contextmanager
def page_server(page: str, port: int) -> Iterator[ThreadingHTTPServer]:
    """Bind a server for a page at `/`, with the files of all pages under `/files/`.

    Raises:
        ConfigError: The port cannot be used.
    """
    if not 0 <= port <= 65535:
        raise ConfigError(f"--port is {port}; allowed: 1 to 65535, or 0 for a free one.")
    answers = {f"/files/{name}": (TYPES[PurePosixPath(name).suffix], data) for name, data in page_files().items()}
    answers["/"] = (TYPES[".html"], page.encode())

    hosts = set[str]()

    class Handler(BaseHTTPRequestHandler):
        """Handler that answers from memory: a path from a request is never opened."""

        server_version = sys_version = ""

        def do_GET(self) -> None:
            """Answer one GET request."""
            # A foreign name that points to this computer is refused, as in the console.
            is_ours = self.headers.get("Host") in hosts
            kind, data = answers.get(self.path, (None, b"")) if is_ours else (None, b"")
            self.send_response(200 if kind else 404 if is_ours else 403)
            for name, value in (SAID_WITH_EVERYTHING | {"Content-Length": str(len(data))}).items():
                self.send_header(name, value)
            if kind:
                self.send_header("Content-Type", kind)
            self.end_headers()
            self.wfile.write(data)

        def log_message(self, format: str, *args: object) -> None:  # noqa: A002 - name of the base class
            """Print nothing: the terminal shows the address only."""

    try:
        server = ThreadingHTTPServer((LOOPBACK, port), Handler)
    except OSError as error:
        raise ConfigError(
            f"Port {port} of {LOOPBACK} cannot be used: {error.strerror}. Give another --port, or end the program "
            "that uses it."
        ) from error
    bound = server.server_address[1]
    hosts |= {f"{LOOPBACK}:{bound}", f"localhost:{bound}"}
    with server:
        yield server


def serve_page(page: str, port: int, opens_browser: bool, say: Callable[[str], None]) -> None:
    """Serve a page until Ctrl-C.

    Raises:
        ConfigError: The port cannot be used.
    """
    with page_server(page, port) as server, contextlib.suppress(KeyboardInterrupt):
        address = f"http://{LOOPBACK}:{server.server_address[1]}/"
        say(f"The page is at {address}. Ctrl-C ends it.")
        if opens_browser:
            webbrowser.open(address)
        server.serve_forever()
