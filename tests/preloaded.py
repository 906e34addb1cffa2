"""Commands of `exograv`, each in a process of its own that starts in milliseconds.

A server process imports the rooms of a flight once and forks for every command. A command has its own arguments,
folder, environment, output and exit status, as `python -m exograv.cli` has, but no second of imports. Where the
start itself, a missing package or a signal is the subject of a test, the test starts Python. The server checks no
shapes, because they make a flight five times slower. Windows cannot fork; there a command starts Python.
"""

import atexit
import json
import os
import signal
import subprocess
import sys
import tempfile
from collections.abc import Mapping, Sequence
from functools import cache
from pathlib import Path
from threading import Lock

from tests.shared import hash_at_first


class Spent:
    """CPU time of all commands of this process [s]; the system counts them only when the server ends."""

    cpu_s = 0.0


def exograv(
    *words: str,
    folder: Path | None = None,
    environment: Mapping[str, str] | None = None,
    check: bool = False,
) -> subprocess.CompletedProcess[str]:
    """Run one command in its own process, and return its output as text.

    Args:
        words: Command and options.
        folder: Working directory of the command.
        environment: All variables of its environment; those of this process if not given.
        check: True if a failed command is an error of the test.
    """
    return _run("exograv.cli", words, folder, environment, check)


def script(
    path: Path, *words: str, folder: Path | None = None, environment: Mapping[str, str] | None = None
) -> subprocess.CompletedProcess[str]:
    """Run a Python file in its own process, as `exograv` runs a command; a failure is an error of the test."""
    return _run(str(path), words, folder, environment, check=True)


class Started:
    """Command that runs beside the test, with pipes to its input and from its output, which holds its errors too."""

    def __init__(self, *words: str, environment: Mapping[str, str] | None = None) -> None:
        self._kept = tempfile.TemporaryDirectory(prefix="exograv-command-")
        heard, said = (Path(self._kept.name, name) for name in ("stdin", "stdout"))
        os.mkfifo(heard)
        os.mkfifo(said)
        self.pid = _server().begin(_request("exograv.cli", words, None, environment, heard, said, said))
        self.stdin = heard.open("w", encoding="utf-8")
        self.stdout = said.open(encoding="utf-8")

    def kill(self) -> None:
        os.kill(self.pid, signal.SIGKILL)

    def wait(self) -> int:
        """Wait for its end, and return its exit status. Call it once."""
        self._kept.cleanup()
        return _server().end_of(self.pid)


def _run(
    target: str, words: Sequence[str], folder: Path | None, environment: Mapping[str, str] | None, check: bool
) -> subprocess.CompletedProcess[str]:
    if not hasattr(os, "fork"):
        command = [sys.executable, *(("-m",) if target == "exograv.cli" else ()), target, *words]
        return subprocess.run(command, cwd=folder, env=environment, check=check, capture_output=True, text=True)
    with tempfile.TemporaryDirectory(prefix="exograv-command-") as kept:
        said, complained = Path(kept, "stdout"), Path(kept, "stderr")
        request = _request(target, words, folder, environment, Path(os.devnull), said, complained)
        code = _server().end_of(_server().begin(request))
        done = subprocess.CompletedProcess(
            [target, *words], code, said.read_text(encoding="utf-8"), complained.read_text(encoding="utf-8")
        )
    if check and done.returncode:
        raise AssertionError(f"{' '.join(done.args)} ended with {done.returncode}:\n{done.stdout}\n{done.stderr}")
    return done


def _request(
    target: str,
    words: Sequence[str],
    folder: Path | None,
    environment: Mapping[str, str] | None,
    heard: Path,
    said: Path,
    complained: Path,
) -> dict[str, object]:
    return {
        "target": target,
        "words": list(words),
        "folder": str(folder or Path.cwd()),
        "environment": dict(os.environ if environment is None else environment),
        "heard": str(heard),
        "said": str(said),
        "complained": str(complained),
    }


class _Server:
    """Process that forks the commands, and the pipes to it."""

    def __init__(self) -> None:
        hash_at_first()  # What the server prepares is kept only if the source is the same before it and after it.
        code = Path(__file__).with_name("preloaded_server.py").read_text(encoding="utf-8")
        pipe = subprocess.PIPE
        self.process = subprocess.Popen([sys.executable, "-c", code], stdin=pipe, stdout=pipe, text=True)
        self.one_at_a_time = Lock()
        atexit.register(self.process.communicate)

    def begin(self, request: dict[str, object]) -> int:
        """Return the process of a new command."""
        return self._ask(request)[0]

    def end_of(self, pid: int) -> int:
        """Wait for a command, count its CPU time, and return its exit status."""
        code, cpu_s = self._ask({"await": pid})
        Spent.cpu_s += cpu_s
        return code

    def _ask(self, request: dict[str, object]) -> tuple[int, float]:
        assert self.process.stdin is not None
        assert self.process.stdout is not None
        with self.one_at_a_time:
            self.process.stdin.write(json.dumps(request) + "\n")
            self.process.stdin.flush()
            answer = self.process.stdout.readline()
        assert answer, "the server of commands has ended"
        number, cpu_s = json.loads(answer)
        return number, cpu_s


@cache
def _server() -> _Server:
    return _Server()
