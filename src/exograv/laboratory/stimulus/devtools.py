"""Chromium without a window, driven through its DevTools protocol.

Source: Chrome DevTools Protocol, chromedevtools.github.io/devtools-protocol.
"""

import contextlib
import itertools
import json
import re
import subprocess
import tempfile
import threading
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from websockets.exceptions import ConnectionClosed
from websockets.sync.client import ClientConnection, connect

from exograv.errors import RigError

STARTS_S, ANSWERS_S = 30.0, 15.0
"""Time-outs for the start of the browser, and for its answer to one command [s]."""

ADDRESS = re.compile(r"DevTools listening on (ws://\S+)")
ARGUMENTS = (
    "--headless=new", "--remote-debugging-port=0", "--no-first-run", "--disable-gpu", "--disable-3d-apis",
    "--disable-background-networking", "--disable-extensions", "--mute-audio",
    # The page is the session's own, and a container without user namespaces has no sandbox.
    "--no-sandbox",
)  # fmt: skip


class BrowserError(RigError):
    """Browser that does not start, or does not do what it was told."""


class DevTools:
    """Page in a browser, commanded over the browser's own protocol."""

    def __init__(self, line: ClientConnection):
        """Open an empty page; `line` is the connection to the browser."""
        self._line, self._numbers, self._session = line, itertools.count(1), ""
        self._answers, self._news = dict[int, dict[str, Any]](), threading.Condition()
        self._wanted, self._is_open = set[int](), True
        threading.Thread(target=self._hear, daemon=True).start()
        page = self.call("Target.createTarget", url="about:blank")["targetId"]
        self._session = self.call("Target.attachToTarget", targetId=page, flatten=True)["sessionId"]

    def call(self, method: str, **parameters: Any) -> dict[str, Any]:
        """Send a command, and return its result.

        Raises:
            BrowserError: The command failed, or the browser has ended.
        """
        number = self.ask(method, **parameters)
        with self._news:
            self._news.wait_for(lambda: number in self._answers or not self._is_open, ANSWERS_S)
        answer = self.answer(number)
        if answer is None:
            raise BrowserError(f"The browser has not answered {method} within {ANSWERS_S:g} s. Start it again.")
        return answer

    def ask(self, method: str, **parameters: Any) -> int:
        """Send a command without waiting; return its number for `answer`."""
        number = next(self._numbers)
        self._wanted.add(number)
        self._send(number, method, parameters)
        return number

    def tell(self, method: str, **parameters: Any) -> None:
        """Send a command whose result nobody reads."""
        self._send(next(self._numbers), method, parameters)

    def answer(self, number: int) -> dict[str, Any] | None:
        """Return the result of a command, once; None if it has not arrived.

        Raises:
            BrowserError: The command failed, or the browser has ended.
        """
        with self._news:
            answer = self._answers.pop(number, None)
        if answer is None:
            if not self._is_open:
                raise BrowserError("The browser has ended. Start the stimulus again.")
            return None
        if "error" in answer:
            raise BrowserError(f"The browser refused a command: {answer['error']['message']}")
        return answer["result"]

    def _send(self, number: int, method: str, parameters: dict[str, Any]) -> None:
        session = {"sessionId": self._session} if self._session else {}
        with contextlib.suppress(ConnectionClosed):
            self._line.send(json.dumps({"id": number, "method": method, "params": parameters, **session}))

    def _hear(self) -> None:
        with contextlib.suppress(ConnectionClosed):
            for text in self._line:
                message = json.loads(text)
                number = message.get("id")
                with self._news:
                    if number in self._wanted:
                        self._wanted.discard(number)
                        self._answers[number] = message
                        self._news.notify_all()
        with self._news:
            self._is_open = False
            self._news.notify_all()


@contextlib.contextmanager
def chromium(program: Path) -> Iterator[DevTools]:
    """Run a browser with one empty page, and end it afterwards.

    Raises:
        BrowserError: The browser does not start.
    """
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as profile:
        command = [str(program), *ARGUMENTS, f"--user-data-dir={profile}", "about:blank"]
        try:
            process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)
        except OSError as error:
            raise BrowserError(
                f"{program} does not start: {error.strerror}. Install Chromium, or name it with --chromium."
            ) from error
        reader = _Output(process)
        try:
            with connect(reader.address(), max_size=None, compression=None) as line:
                yield DevTools(line)
        finally:
            process.terminate()
            with contextlib.suppress(subprocess.TimeoutExpired):
                process.wait(5.0)
            process.kill()
            process.wait()
            reader.close()


class _Output:
    """Output of the browser: its address, and what it says before; the rest is read and dropped."""

    def __init__(self, process: "subprocess.Popen[str]"):
        assert process.stderr is not None
        self._lines, self._found, self._said = process.stderr, list[str](), list[str]()
        self._is_known = threading.Event()
        self._thread = threading.Thread(target=self._read, daemon=True)
        self._thread.start()

    def address(self) -> str:
        """Wait for the address of the DevTools."""
        self._is_known.wait(STARTS_S)
        if not self._found:
            said = "".join(self._said)[-500:] or "nothing"
            raise BrowserError(f"The browser has printed no address of its DevTools. Its output: {said}")
        return self._found[0]

    def close(self) -> None:
        """Close the output of a browser that has ended."""
        self._thread.join(STARTS_S)
        self._lines.close()

    def _read(self) -> None:
        for text in self._lines:
            if self._found:
                continue
            self._said.append(text)
            if match := ADDRESS.search(text):
                self._found.append(match[1])
                self._is_known.set()
        self._is_known.set()
