"""Operator's page in a terminal: it logs in, steers and asks as the page in a browser does, over the same line."""

import contextlib
import itertools
import json
import ssl
import threading
import time
import urllib.error
import urllib.request
from collections.abc import Callable
from pathlib import Path
from typing import Any

from websockets.exceptions import ConnectionClosed
from websockets.sync.client import connect
from websockets.typing import Origin

from exograv.errors import RigError

from .http_guard import CSRF_HEADER
from .keys import Role
from .lease import BEAT_EVERY_S

ANSWERS_WITHIN_S = 10.0
"""Time-out for the server's answer [s]."""

LOOKS_EVERY_S = 0.05
PINGS = 3
"""Number of first pings, after which the server knows the clock of this page."""


class TerminalPage:
    """Line of the operator in the terminal. The server treats it as any page of an operator."""

    def __init__(self, link: str, certificate: Path | None = None):
        """Log in with the operator's link, and open the line.

        Args:
            link: Link of the operator, which works once.
            certificate: Certificate of the server; None without TLS.

        Raises:
            RigError: The server does not accept the login.
        """
        origin, _, token = link.partition("/#")
        self._begun, self._numbers = time.perf_counter(), itertools.count(1)
        self._answers, self._news = dict[str, dict[str, Any]](), threading.Condition()
        self._pongs, self._number = 0, -1
        self.state: dict[str, Any] | None = None
        """Newest state of the session; None before the first."""
        self.ended = ""
        """Reason why the line has ended; empty while it is open."""
        tls = None if certificate is None else ssl.create_default_context(cafile=str(certificate))
        ours = {CSRF_HEADER: "1", "Origin": origin}
        try:
            cookie = _posted(f"{origin}/enter", {"token": token}, ours, tls)[0]
            ours = {**ours, "Cookie": cookie}
            ticket = _posted(f"{origin}/{Role.OPERATOR.value}/ticket", {}, ours, tls)[1]["ticket"]
        except urllib.error.URLError as error:
            raise RigError(f"The server of the pages does not accept the terminal: {error}.") from error
        self._stack = contextlib.ExitStack()
        address = f"ws{origin.removeprefix('http')}/{Role.OPERATOR.value}/line"
        self._line = self._stack.enter_context(
            connect(address, origin=Origin(origin), additional_headers={"Cookie": cookie}, ssl=tls)
        )
        self._send("hello", ticket=ticket, page="page-in-a-terminal")
        for task in (self._hear, self._live):
            threading.Thread(target=task, daemon=True).start()
        self.until(lambda: self._pongs >= PINGS and self.state is not None, ANSWERS_WITHIN_S)

    @property
    def shown(self) -> dict[str, Any]:
        """Newest snapshot of the machine."""
        return {} if self.state is None else self.state["shown"]

    @property
    def steers(self) -> bool:
        """True if this page holds the lease, as far as it has heard."""
        return self.state is not None and self.state["steers"] == self._number

    def is_open_for(self, role: Role) -> bool:
        """Return True if a page of this role is connected."""
        return self.state is not None and any(line["role"] == role.value for line in self.state["lines"])

    def steer(self) -> str:
        """Ask for the lease. Return the reason of a refusal; empty if this page steers now."""
        return self._ask("steer")

    def act(self, kind: str, **fields: Any) -> str:
        """Ask for an act. Return the reason of a refusal; empty if it was carried out."""
        version = {} if kind in ("give_back", "switch_off", "stop") else {"seen_version": self.shown["version"]}
        return self._ask("do", made=self._now(), act={"kind": kind, **fields}, **version)

    def run(self, word: str) -> str:
        """Give a command to the protocol. Return the reason of a refusal; empty if it was carried out."""
        return self._ask("run", made=self._now(), word=word)

    def invite(self, role: Role) -> str:
        """Return a link for another page."""
        return str(self._answer("invite", role=role.value).get("link", ""))

    def until(self, condition: Callable[[], object], within_s: float) -> bool:
        """Wait until the condition holds or the line has ended. Return False after the time-out [s]."""
        ends = time.monotonic() + within_s
        while not condition():
            if self.ended or time.monotonic() > ends:
                return False
            time.sleep(LOOKS_EVERY_S)
        return True

    def close(self) -> None:
        """Close the connection to the session."""
        self._stack.close()

    def _ask(self, kind: str, **fields: Any) -> str:
        answer = self._answer(kind, **fields).get("answer")
        if answer is None:
            return self.ended or "The server did not answer in time."
        return "" if answer["taken"] else answer["why"]["text"]

    def _answer(self, kind: str, **fields: Any) -> dict[str, Any]:
        name = f"terminal-{next(self._numbers):06d}"
        self._send(kind, id=name, **fields)
        with self._news:
            self._news.wait_for(lambda: name in self._answers or self.ended, ANSWERS_WITHIN_S)
            return self._answers.pop(name, {})

    def _send(self, kind: str, **fields: Any) -> None:
        with contextlib.suppress(ConnectionClosed):
            self._line.send(json.dumps({"kind": kind, **fields}))

    def _now(self) -> float:
        return time.perf_counter() - self._begun

    def _hear(self) -> None:
        with contextlib.suppress(ConnectionClosed):
            for text in self._line:
                self._take(json.loads(text))
        with self._news:
            self.ended = self.ended or "The line to the server of the pages has ended."
            self._news.notify_all()

    def _take(self, message: dict[str, Any]) -> None:
        kind = message["kind"]
        if kind == "answer":
            with self._news:
                self._answers[message["answer"]["id"]] = message
                self._news.notify_all()
        elif kind == "pong":
            self._pongs += 1
            if self._pongs < PINGS:
                back = self._now()
                self._send("ping", asked=back, previous={"asked": message["asked"], "back": back})
        elif kind == "welcome":
            self._number = message["line"]
        elif kind == "state":
            self.state = message
        elif kind == "ended":
            self.ended = message["why"]["text"]

    def _live(self) -> None:
        """Send heartbeats: they hold the lease as long as this process lives."""
        self._send("ping", asked=self._now())
        while not self.ended:
            self._send("beat")
            time.sleep(BEAT_EVERY_S)


def _posted(
    url: str, body: dict[str, str], headers: dict[str, str], tls: ssl.SSLContext | None
) -> tuple[str, dict[str, Any]]:
    """Return cookie and body of the server's answer."""
    asked = urllib.request.Request(url, json.dumps(body).encode(), headers)
    with urllib.request.urlopen(asked, context=tls, timeout=ANSWERS_WITHIN_S) as answer:
        return (answer.headers["Set-Cookie"] or "").partition(";")[0], json.loads(answer.read())
