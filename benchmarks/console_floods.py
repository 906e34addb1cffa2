"""Latency of Stop under floods of the console's server, and what the floods take from other pages.

    python benchmarks/console_floods.py --presses 60 [--tls] [--markdown]

The console is rehearsed, in its own processes. An operator's page presses Stop and waits for the answer, so that each
figure is the way to the desk and back. Each flood runs in a process of its own on the same computer, from the same
address as the page. At the end of a flood a participant logs in with a new link. Exit code 1 if a press took longer
than 50 ms, or if the participant did not get in. With `--tls` the console serves a network, with a certificate that
openssl makes, and the floods use TLS.
"""

import argparse
import contextlib
import errno
import json
import multiprocessing
import os
import random
import re
import resource
import selectors
import socket
import ssl
import statistics
import subprocess
import sys
import tempfile
import threading
import time
import urllib.error
import urllib.request
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from websockets.exceptions import InvalidHandshake, WebSocketException
from websockets.sync.client import ClientConnection, connect
from websockets.typing import Origin

STOP_MAX_MS = 50.0
"""Allowed time of a press of Stop, with its answer [ms]."""

DESCRIPTORS = 1024
"""Descriptors of an ordinary process, which the console gets here."""

CONNECTIONS = 1100
"""Connections of a flood, more than an ordinary process has descriptors."""

WARM_UP_S, APART_S = 1.5, (0.02, 0.06)
"""Time from the start of a flood to the first press, and between two presses [s]."""

UNANSWERED_MAX = 3
"""Number of presses without an answer that end a flood."""

LOGIN_MAX_S = 20.0
"""Time for the participant to get in during a flood [s]."""

TRY_S = 5.0
"""Time-out of one request or connection [s]."""

LAN = "127.0.0.2"
"""Address of the console in its network; no other computer reaches it."""

HALF_HELLO = bytes.fromhex("16030102000100")
"""Begin of a TLS handshake: a record whose other bytes do not come."""


def tls_of(origin: str) -> ssl.SSLContext | None:
    """Return the TLS settings of a client of this origin; None without TLS."""
    if not origin.startswith("https"):
        return None
    context = ssl.create_default_context()
    context.check_hostname, context.verify_mode = False, ssl.CERT_NONE  # the certificate is made for one run
    return context


@dataclass(frozen=True)
class Login:
    """Login of a page."""

    origin: str
    role: str
    cookie: str

    @property
    def host(self) -> str:
        """Host with port."""
        return self.origin.partition("://")[2]

    def post(self, path: str) -> dict[str, Any]:
        """Send a POST of the page, and return the answer."""
        headers = {"X-Exograv": "1", "Origin": self.origin, "Cookie": self.cookie}
        asked = urllib.request.Request(f"{self.origin}{path}", b"", headers)
        with urllib.request.urlopen(asked, None, TRY_S, context=tls_of(self.origin)) as given:
            return json.loads(given.read())

    @contextlib.contextmanager
    def line(self, name: str = "page-of-a-flood") -> Iterator[ClientConnection]:
        """Open a line up to its hello."""
        ticket = self.post(f"/{self.role}/ticket")["ticket"]
        context = tls_of(self.origin)
        with connect(
            f"{'ws' if context is None else 'wss'}://{self.host}/{self.role}/line",
            ssl=context,
            origin=Origin(self.origin),
            additional_headers={"Cookie": self.cookie},
            compression=None,
            open_timeout=TRY_S,
            close_timeout=0.1,
        ) as line:
            # As a browser does: otherwise a press waits for the acknowledgement of the heartbeat before it, for 40 ms.
            line.socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            line.send(json.dumps({"kind": "hello", "ticket": ticket, "page": name}))
            yield line


def log_in(link: str) -> Login:
    """Exchange the token of a link for a cookie."""
    origin, _, token = link.partition("/#")
    headers = {"X-Exograv": "1", "Origin": origin}
    asked = urllib.request.Request(f"{origin}/enter", json.dumps({"token": token}).encode(), headers)
    with urllib.request.urlopen(asked, None, TRY_S, context=tls_of(origin)) as entered:
        cookie, role = entered.headers["Set-Cookie"].partition(";")[0], json.loads(entered.read())["role"]
    return Login(origin, role, cookie)


class Operator:
    """Operator's page: it keeps the lease, and waits for answers."""

    def __init__(self, line: ClientConnection):
        """Use the page's line."""
        self._line, self._answers = line, dict[str, dict[str, Any]]()
        self._came, self._number = threading.Condition(), 0
        for task in (self._hear, self._live):
            threading.Thread(target=task, daemon=True).start()

    def ask(self, kind: str, within_s: float = TRY_S, **fields: Any) -> dict[str, Any] | None:
        """Send a message and return its answer; None if it does not come in time."""
        self._number += 1
        name = f"asked-{self._number:06d}"
        with contextlib.suppress(WebSocketException):
            self._line.send(json.dumps({"kind": kind, "id": name, **fields}))
        with self._came:
            return self._answers.pop(name) if self._came.wait_for(lambda: name in self._answers, within_s) else None

    def link(self, role: str) -> str:
        """Return a link for another person."""
        answer = self.ask("invite", role=role)
        assert answer is not None
        return answer["link"]

    def stop_ms(self) -> float:
        """Press Stop; return the time until its answer [ms], infinite without one."""
        begun = time.perf_counter()
        answer = self.ask("do", made=begun, act={"kind": "stop"})
        return float("inf") if answer is None else 1e3 * (time.perf_counter() - begun)

    def _hear(self) -> None:
        with contextlib.suppress(WebSocketException):
            for text in self._line:
                message = json.loads(text)
                if message["kind"] == "answer":
                    with self._came:
                        self._answers[message["answer"]["id"]] = message
                        self._came.notify_all()

    def _live(self) -> None:
        with contextlib.suppress(WebSocketException):
            while True:
                self._line.send(json.dumps({"kind": "beat"}))
                time.sleep(0.2)


def hold_connections(login: Login, said: bytes = b"", is_raw: bool = False) -> None:
    """Keep many connections open that send `said` and no more; open a new one for each that is closed.

    With `is_raw` the bytes are sent before any TLS handshake.
    """
    host, port = login.host.split(":")
    context = None if is_raw or not said else tls_of(login.origin)
    waiting, quiet = selectors.DefaultSelector(), set[socket.socket]()
    while True:
        for _ in range(CONNECTIONS - len(waiting.get_map())):
            one: Any = socket.socket()
            one.setblocking(False)
            if one.connect_ex((host, int(port))) in (0, errno.EINPROGRESS):
                waiting.register(one, selectors.EVENT_READ | (selectors.EVENT_WRITE if said else 0))
        for key, events in waiting.select(0.05):
            one = key.fileobj
            try:
                if said and one not in quiet:
                    one = _shaken(one, context, waiting)
                    one.send(said)
                    quiet.add(one)
                    waiting.modify(one, selectors.EVENT_READ)
                elif events & selectors.EVENT_READ and not one.recv(4096):
                    raise ConnectionResetError
            except (ssl.SSLWantReadError, ssl.SSLWantWriteError):
                pass
            except OSError:
                one = next((each for each in waiting.get_map().values() if each.fd == key.fd), key).fileobj
                quiet.discard(one)
                waiting.unregister(one)
                one.close()


def _shaken(one: Any, context: ssl.SSLContext | None, waiting: selectors.BaseSelector) -> Any:
    """Go on with the TLS handshake of a connection, if it needs one; return its socket."""
    if context is not None and not isinstance(one, ssl.SSLSocket):
        waiting.unregister(one)
        one = context.wrap_socket(one, do_handshake_on_connect=False, suppress_ragged_eofs=True)
        waiting.register(one, selectors.EVENT_READ | selectors.EVENT_WRITE)
    if isinstance(one, ssl.SSLSocket):
        waiting.modify(one, selectors.EVENT_READ)
        one.do_handshake()
    return one


def half_headers(login: Login) -> None:
    """Keep many connections open with a header that never ends."""
    hold_connections(login, f"GET / HTTP/1.1\r\nHost: {login.host}\r\nX-Slow: ".encode())


def half_handshakes(login: Login) -> None:
    """Keep many connections open with a TLS handshake that never ends."""
    hold_connections(login, HALF_HELLO, is_raw=True)


def nonsense(login: Login) -> None:
    """Send a header that is none on connection after connection; the door cannot see that it is wrong."""
    hold_connections(login, b"GET / HTTP/1.1\r\nno header\r\n\r\n")


def wrong_tokens(login: Login) -> None:
    """Try wrong tokens on twenty connections at once."""
    body = json.dumps({"token": "x" * 43})
    head = f"POST /enter HTTP/1.1\r\nHost: {login.host}\r\nOrigin: {login.origin}\r\nX-Exograv: 1\r\n"
    _on_connections(login, 20, f"{head}Content-Length: {len(body)}\r\n\r\n{body}".encode())


def tickets(login: Login) -> None:
    """Ask for ticket after ticket with the viewer's login, on ten connections."""
    head = f"POST /viewer/ticket HTTP/1.1\r\nHost: {login.host}\r\nOrigin: {login.origin}\r\nX-Exograv: 1\r\n"
    _on_connections(login, 10, f"{head}Cookie: {login.cookie}\r\nContent-Length: 0\r\n\r\n".encode())


def lines(login: Login) -> None:
    """Open line after line with the viewer's login, and keep them."""
    with contextlib.ExitStack() as opened:
        while True:
            try:
                opened.enter_context(login.line())
            except (OSError, InvalidHandshake):
                time.sleep(0.01)


def messages(login: Login) -> None:
    """Send more messages than are allowed on the viewer's lines, and connect again when they are closed."""

    def send_all() -> None:
        while True:
            with contextlib.suppress(OSError, WebSocketException), login.line() as line:
                while True:
                    line.send('{"kind":"ping","asked":1.0}')

    for _ in range(3):
        threading.Thread(target=send_all, daemon=True).start()
    threading.Event().wait()


def _on_connections(login: Login, count: int, request: bytes) -> None:
    """Send a request again and again on `count` connections at once."""
    host, port = login.host.split(":")
    context = tls_of(login.origin)

    def send_all() -> None:
        while True:
            with contextlib.suppress(OSError), socket.create_connection((host, int(port)), TRY_S) as plain:
                one = plain if context is None else context.wrap_socket(plain)
                while True:
                    one.sendall(request)
                    if not one.recv(65536):
                        break

    for _ in range(count):
        threading.Thread(target=send_all, daemon=True).start()
    threading.Event().wait()


HANDSHAKES = "handshakes"
"""Flood of a console with TLS only."""

FLOODS: dict[str, tuple[str, Callable[[Login], None] | None]] = {
    "quiet": ("no flood", None),
    "connections": (f"{CONNECTIONS} connections without a login", hold_connections),
    "half-headers": (f"{CONNECTIONS} connections with a header that never ends", half_headers),
    HANDSHAKES: (f"{CONNECTIONS} connections with a TLS handshake that never ends", half_handshakes),
    "nonsense": ("requests with a wrong header, on connection after connection", nonsense),
    "wrong-tokens": ("wrong tokens on 20 connections", wrong_tokens),
    "lines": ("one viewer opens line after line", lines),
    "tickets": ("one viewer asks for ticket after ticket", tickets),
    "messages": ("one viewer sends more messages than are allowed", messages),
}


@dataclass(frozen=True)
class Flooded:
    """Result of one flood."""

    stop_ms: list[float]
    login_s: float | None
    """Time until the participant's page had its line [s]; None if it did not get in."""
    log_bytes: int
    """Output of the console on its terminal."""

    @property
    def is_good(self) -> bool:
        """True if every press was quick and the participant got in."""
        return max(self.stop_ms) <= STOP_MAX_MS and self.login_s is not None


def certificate(folder: Path) -> list[str]:
    """Make a certificate; return the options of a console that serves a network with it."""
    made, key = folder / "certificate.pem", folder / "key.pem"
    words = ["openssl", "req", "-x509", "-newkey", "rsa:2048", "-nodes", "-days", "1", "-subj", f"/CN={LAN}"]
    subprocess.run([*words, "-keyout", key, "-out", made], check=True, capture_output=True)
    return ["--lan", LAN, "--certificate", str(made), "--key", str(key)]


@contextlib.contextmanager
def console(folder: Path, has_tls: bool) -> Iterator[tuple[str, Path]]:
    """Run a rehearsed console; yield the operator's link and the file of its output."""
    command = [sys.executable, "-m", "exograv.cli", "run", "console", "--rehearse", "--no-browser", "--port", "0"]
    command += certificate(folder) if has_tls else []
    log = folder / "output.txt"
    with log.open("wb") as file:
        limit = ["prlimit", f"--nofile={DESCRIPTORS}:{DESCRIPTORS}"]
        process = subprocess.Popen(
            [*limit, *command, "--out", str(folder)],
            stdout=file,
            stderr=file,
            env={**os.environ, "PYTHONUNBUFFERED": "1"},
        )
        try:
            until, found = time.monotonic() + 60.0, None
            while found is None:
                assert process.poll() is None, log.read_text()
                assert time.monotonic() < until, log.read_text()
                time.sleep(0.05)
                found = re.search(r"https?://\S+/#\S+", log.read_text())
            yield found[0], log
        finally:
            process.terminate()
            try:
                process.wait(30.0)
            except subprocess.TimeoutExpired:
                process.kill()


def come_in(link: str) -> float | None:
    """Let a participant in as a page would, with repetitions; return the time that it took [s]."""
    begun, login = time.monotonic(), None
    while time.monotonic() - begun < LOGIN_MAX_S:
        try:
            login = login or log_in(link)
            with login.line() as line:
                if json.loads(line.recv(TRY_S))["kind"] == "welcome":
                    return time.monotonic() - begun
        except (OSError, WebSocketException, urllib.error.HTTPError):
            time.sleep(0.2)
    return None


def flood(name: str, presses: int, has_tls: bool) -> Flooded:
    """Run one flood against a console of its own."""
    work, draw = FLOODS[name][1], random.Random(0)
    with (
        tempfile.TemporaryDirectory() as folder,
        console(Path(folder), has_tls) as (link, log),
        log_in(link).line("page-of-the-operator") as line,
    ):
        operator = Operator(line)
        viewer, participant = log_in(operator.link("viewer")), operator.link("participant")
        process = None
        if work is not None:
            process = multiprocessing.get_context("spawn").Process(target=work, args=(viewer,), daemon=True)
            process.start()
        time.sleep(WARM_UP_S)
        taken = list[float]()
        while len(taken) < presses and taken.count(float("inf")) < UNANSWERED_MAX:
            time.sleep(draw.uniform(*APART_S))
            taken.append(operator.stop_ms())
        login_s = come_in(participant)
        if process is not None:
            process.kill()
        return Flooded(taken, login_s, log.stat().st_size)


def main() -> int:
    """Run the floods, and print a table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--presses", type=int, default=60)
    parser.add_argument("--only", choices=FLOODS, action="append")
    parser.add_argument("--tls", action="store_true", help="the console serves a network, with TLS")
    parser.add_argument("--markdown", action="store_true", help="print the table of the documentation")
    arguments = parser.parse_args()
    raise_descriptors()
    if arguments.markdown:
        print(
            "| flood | Stop: median, p99, worst [ms] | participant gets in after [s] | output [kB] |\n|---|---|---|---|"
        )
    is_good = True
    for name in arguments.only or [one for one in FLOODS if arguments.tls or one != HANDSHAKES]:
        found = flood(name, arguments.presses, arguments.tls)
        is_good &= found.is_good
        ms = sorted(found.stop_ms)
        p99 = ms[min(round(0.99 * len(ms)), len(ms) - 1)]
        login = "never" if found.login_s is None else f"{found.login_s:.2f}"
        said = [FLOODS[name][0], f"{statistics.median(ms):.1f}, {p99:.1f}, {ms[-1]:.1f}", login]
        said.append(f"{found.log_bytes / 1e3:.1f}")
        print(f"| {' | '.join(said)} |" if arguments.markdown else "; ".join(said), flush=True)
    return 0 if is_good else 1


def raise_descriptors() -> None:
    """Allow this process and its floods as many descriptors as the system grants."""
    _, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    resource.setrlimit(resource.RLIMIT_NOFILE, (hard, hard))


if __name__ == "__main__":
    sys.exit(main())
