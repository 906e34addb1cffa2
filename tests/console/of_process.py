"""Process with a real `exograv run console`, and pages without a browser that connect to it."""

import contextlib
import itertools
import json
import os
import re
import signal
import subprocess
import sys
import threading
import time
import urllib.request
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from tests.waiting import wait_until
from websockets.exceptions import ConnectionClosed
from websockets.sync.client import connect
from websockets.typing import Origin

from exograv.task.protocol import FOLDER

SOON_S = 30.0
"""Longest start of a program on a busy computer [s]."""

BEAT_S = 0.2
NUMBERS = itertools.count(1)
"""Numbers of requests. No two pages of a test send the same identifier."""


EDITS = (
    ('rests = "sets_of_five"', 'rests = "short"'),
    ("return_after_s = 0.8", "return_after_s = 0.1"),
    ("tolerance_s = 0.5", "tolerance_s = 0.1"),
)
"""Changes of every shortened protocol."""


def short_file(folder: Path, window_s: float = 3.0) -> Path:
    """Write a passive protocol of three short windows, the first after half a second."""
    edits = (
        ("before_first_s = 35.0", "before_first_s = 0.5"),
        ("after_last_s = 123.0", "after_last_s = 1.0"),
        ("unpublished = [", 'unpublished = [\n  "windows.duration_s", "windows.levels",'),
        ("count = 31", "count = 3"),
        ("duration_s = 22.0", f"duration_s = {window_s}"),
    )
    return _shortened(folder, "familiarisation", edits, r"\[rest_tables\.cycle_180\].*?(?=# Red and green)", 1.0)


def short_training(folder: Path, window_s: float = 3.0) -> Path:
    """Write the training protocol with two short windows."""
    edits = (
        ("before_first_s = 35.0", "before_first_s = 7.5"),
        ("after_last_s = 123.0", "after_last_s = 8.0"),
        ("unpublished = [", 'unpublished = [\n  "windows.duration_s", "windows.count",'),
        ("count = 31", "count = 2"),
        ("duration_s = 22.0", f"duration_s = {window_s}"),
    )
    return _shortened(folder, "training", edits, r"# Window and rest are.*?(?=\[ramps\])", 16.0)


def _shortened(folder: Path, name: str, edits: tuple[tuple[str, str], ...], rests: str, rest_s: float) -> Path:
    """Write a shipped protocol with these changes, and with one rest in place of the tables that `rests` matches."""
    text = (FOLDER / f"{name}.toml").read_text(encoding="utf-8")
    for before, after in (*EDITS, *edits):
        assert before in text
        text = text.replace(before, after, 1)
    path = folder / "short.toml"
    text = re.sub(rests, f"[rest_tables.short]\nrest_s = {rest_s}\n\n", text, flags=re.DOTALL)
    path.write_text(text, encoding="utf-8")
    return path


class Page:
    """Page without a browser: it logs in with a link, sends pings, and sends heartbeats if it steers."""

    def __init__(self, link: str, name: str = "page-of-a-test", login: tuple[str, str] | None = None):
        """Log in with the link, or come back with the cookie and the role of an earlier login."""
        origin, _, token = link.partition("/#")
        self.name, self.heard = name, dict[str, Any]()
        """Latest message of each kind."""
        self.answers, self.touched = dict[str, Any](), list[dict[str, Any]]()
        body, ours = json.dumps({"token": token}).encode(), {"X-Exograv": "1", "Origin": origin}
        if login is None:
            with urllib.request.urlopen(urllib.request.Request(f"{origin}/enter", body, ours)) as entered:
                login = entered.headers["Set-Cookie"].partition(";")[0], json.loads(entered.read())["role"]
        self.login = login
        cookie, role = login
        asked = urllib.request.Request(f"{origin}/{role}/ticket", b"", {**ours, "Cookie": cookie})
        with urllib.request.urlopen(asked) as given:
            ticket = json.loads(given.read())["ticket"]
        self._stack = contextlib.ExitStack()
        self._line = self._stack.enter_context(connect(
            f"ws{origin.removeprefix('http')}/{role}/line", origin=Origin(origin),
            additional_headers={"Cookie": cookie}, open_timeout=SOON_S,
        ))  # fmt: skip
        self._beats, self.pongs = role in ("operator", "therapist"), 0
        self.say("hello", ticket=ticket, page=name)
        for task in (self._hear, self._live):
            threading.Thread(target=task, daemon=True).start()
        self.until(lambda: self.pongs > 2)

    def say(self, kind: str, **fields: Any) -> None:
        self._line.send(json.dumps({"kind": kind, **fields}))

    def ask(self, kind: str, **fields: Any) -> dict[str, Any]:
        """Send a message and wait for its answer."""
        name = f"asked-{next(NUMBERS):06d}"
        self.say(kind, id=name, **fields)
        self.until(lambda: name in self.answers)
        return self.answers[name]

    def act(self, kind: str, **fields: Any) -> dict[str, Any]:
        return self.ask("do", made=time.perf_counter() - BEGUN, act={"kind": kind}, **fields)

    def run(self, word: str) -> dict[str, Any]:
        return self.ask("run", made=time.perf_counter() - BEGUN, word=word)

    def ask_link(self, role: str) -> str:
        """Ask for a link for another person; only an operator gets one."""
        name = f"asked-{next(NUMBERS):06d}"
        self.say("invite", id=name, role=role)
        self.until(lambda: name in self.answers)
        return self.heard["answer"]["link"]

    def touch(self, sequence: int) -> None:
        place = {"x_px": 963.0, "y_px": 544.0, "target_x_px": 960.0, "target_y_px": 540.0}
        touch = {
            "page": self.name, "origin_ms": 1.7e12, "at": time.perf_counter() - BEGUN, "sequence": sequence, **place,
            "width_px": 10.0, "height_px": 12.0, "pressure": 0.5, "pointer": "touch", "is_primary": True, "ratio": 1.0,
            "zoom": 1.0,
        }  # fmt: skip
        self.say("touches", touches=[touch])

    def until(self, condition: Callable[[], object], seconds: float = SOON_S) -> None:
        wait_until(condition, lambda: self.heard.get("state"), seconds)

    @property
    def shown(self) -> dict[str, Any]:
        """Latest snapshot of the machine."""
        self.until(lambda: "state" in self.heard)
        return self.heard["state"]["shown"]

    @property
    def alarms(self) -> list[str]:
        """Latest alarms of the machine."""
        return [alarm["text"]["text"] for alarm in self.shown["alarms"]]

    @property
    def run_shown(self) -> dict[str, Any]:
        """Latest state of the protocol on the operator's page."""
        self.until(lambda: "state" in self.heard)
        return self.heard["state"]["run"]

    @property
    def window(self) -> int | None:
        """Open window of the protocol."""
        return next((each["number"] for each in self.run_shown["windows"] if each["is_open"]), None)

    def _hear(self) -> None:
        with contextlib.suppress(ConnectionClosed):
            for text in self._line:
                message = json.loads(text)
                if message["kind"] == "answer":
                    self.answers[message["answer"]["id"]] = message["answer"]
                elif message["kind"] == "touched":
                    self.touched.append(message)
                elif message["kind"] == "pong":
                    self.pongs, back = self.pongs + 1, time.perf_counter() - BEGUN
                    if self.pongs < 3:
                        self.say("ping", asked=back, previous={"asked": message["asked"], "back": back})
                self.heard[message["kind"]] = message

    def _live(self) -> None:
        with contextlib.suppress(ConnectionClosed):
            self.until(lambda: "welcome" in self.heard)
            self.say("ping", asked=time.perf_counter() - BEGUN)
            while True:
                if self._beats:
                    self.say("beat")
                time.sleep(BEAT_S)

    def __enter__(self) -> "Page":
        return self

    def __exit__(self, *_: object) -> None:
        self._stack.close()


BEGUN = time.perf_counter()


@contextmanager
def console(*options: str | Path, module: str = "exograv.cli") -> Iterator[tuple[subprocess.Popen[str], str]]:
    """Start the process; yield it with the operator's link; kill it at the end."""
    command = [sys.executable, "-m", module, "console", "--no-browser", "--port", "0", *map(str, options)]
    process = subprocess.Popen(
        command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, start_new_session=True,
        env={**os.environ, "PYTHONUNBUFFERED": "1"},
    )  # fmt: skip
    assert process.stdout is not None
    try:
        said = ""
        for line in process.stdout:
            said += line
            if found := re.search(r"https?://\S+/#\S+", line):
                yield process, found[0]
                return
        raise AssertionError(said)
    finally:
        with contextlib.suppress(ProcessLookupError):
            os.killpg(process.pid, signal.SIGKILL)
        process.wait()
        process.stdout.close()
