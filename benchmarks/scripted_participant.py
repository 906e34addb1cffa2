"""Participant without a browser: it touches the target in each window, over the line of the participant's page.

Like the page, it sends a touch again until the server has acknowledged it, also after the line was interrupted.
"""

import contextlib
import itertools
import json
import threading
import time
import urllib.request
from typing import Any

from websockets.exceptions import WebSocketException
from websockets.sync.client import ClientConnection, connect
from websockets.typing import Origin

TOUCHES, EVERY_S = 3, 2.0
"""Touches in a window, and the time between them [s]."""

POLL_S = 0.05
BEGUN = time.perf_counter()


class ScriptedParticipant:
    """Participant with a page of its own name."""

    def __init__(self, link: str, name: str):
        """Log in with the link, and touch until `close`."""
        self._origin, _, token = link.partition("/#")
        self.name, self.acknowledged = name, set[tuple[str, int]]()
        """Touches that the server has acknowledged, by page and number."""
        self._unsure = dict[int, dict[str, Any]]()
        self._numbers, self._picture, self._is_over = itertools.count(1), dict[str, Any](), threading.Event()
        entered = self._post("enter", json.dumps({"token": token}).encode(), {})
        with entered:
            self._cookie = entered.headers["Set-Cookie"].partition(";")[0]
        self._line: ClientConnection | None = None
        self._threads = [threading.Thread(target=task, daemon=True) for task in (self._live, self._touch)]
        for thread in self._threads:
            thread.start()

    def close(self) -> None:
        """End the touches."""
        self._is_over.set()
        if self._line is not None:
            with contextlib.suppress(OSError, WebSocketException):
                self._line.close()

    def _post(self, path: str, body: bytes, more: dict[str, str]) -> Any:
        ours = {"X-Exograv": "1", "Origin": self._origin, **more}
        return urllib.request.urlopen(urllib.request.Request(f"{self._origin}/{path}", body, ours), timeout=10.0)

    def _live(self) -> None:
        """Hold a line to the server; connect again when it ends."""
        while not self._is_over.is_set():
            with contextlib.suppress(OSError, WebSocketException, ValueError):
                self._connect()
            self._is_over.wait(0.3)

    def _connect(self) -> None:
        with self._post("participant/ticket", b"", {"Cookie": self._cookie}) as given:
            ticket = json.loads(given.read())["ticket"]
        address = f"ws{self._origin.removeprefix('http')}/participant/line"
        headers = {"Cookie": self._cookie}
        with connect(address, origin=Origin(self._origin), additional_headers=headers, open_timeout=10.0) as line:
            self._say(line, "hello", ticket=ticket, page=self.name)
            self._say(line, "ping", asked=time.perf_counter() - BEGUN)
            self._line, pongs = line, 0
            for touch in list(self._unsure.values()):
                self._say(line, "touches", touches=[touch])
            for text in line:
                message = json.loads(text)
                if message["kind"] == "picture":
                    self._picture = message["picture"] or {}
                elif message["kind"] == "touched":
                    self._unsure.pop(message["sequence"], None)
                    self.acknowledged.add((message["page"], message["sequence"]))
                elif message["kind"] == "pong" and (pongs := pongs + 1) < 3:
                    back = time.perf_counter() - BEGUN
                    self._say(line, "ping", asked=back, previous={"asked": message["asked"], "back": back})

    def _touch(self) -> None:
        """Touch the target some times in each window, and once in each rest."""
        seen, made = None, 0
        while not self._is_over.wait(POLL_S):
            screen, window = self._picture.get("screen"), self._picture.get("window")
            if (screen, window) != seen:
                seen, made = (screen, window), 0
                continue
            if screen not in ("task", "rest") or made >= (TOUCHES if screen == "task" else 1):
                continue
            made += 1
            self._make()
            self._is_over.wait(EVERY_S)

    def _make(self) -> None:
        sequence = next(self._numbers)
        touch = {
            "page": self.name, "origin_ms": 1.7e12, "at": time.perf_counter() - BEGUN, "sequence": sequence,
            "x_px": 963.0, "y_px": 544.0, "target_x_px": 960.0, "target_y_px": 540.0, "width_px": 10.0,
            "height_px": 12.0, "pressure": 0.5, "pointer": "touch", "is_primary": True, "ratio": 1.0, "zoom": 1.0,
        }  # fmt: skip
        self._unsure[sequence] = touch
        if self._line is not None:
            self._say(self._line, "touches", touches=[touch])

    @staticmethod
    def _say(line: ClientConnection, kind: str, **fields: Any) -> None:
        with contextlib.suppress(OSError, WebSocketException):
            line.send(json.dumps({"kind": kind, **fields}))
