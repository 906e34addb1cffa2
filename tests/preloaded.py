"""Commands of `exograv`, each in a process of its own that starts in milliseconds.

A server process imports the rooms of a flight once and forks for every command. A command has its own arguments,
folder, environment, output and exit status, as `python -m exograv.cli` has, but no second of imports. Where the
start itself, a missing package or a signal is the subject of a test, the test starts Python. The server checks no
shapes, because they make a flight five times slower.
"""

import atexit
import json
import os
import subprocess
import sys
import tempfile
from collections.abc import Mapping, Sequence
from functools import cache
from pathlib import Path
from threading import Lock


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


def _run(
    target: str, words: Sequence[str], folder: Path | None, environment: Mapping[str, str] | None, check: bool
) -> subprocess.CompletedProcess[str]:
    with tempfile.TemporaryDirectory(prefix="exograv-command-") as kept:
        said, complained = Path(kept, "stdout"), Path(kept, "stderr")
        request = {
            "target": target,
            "words": list(words),
            "folder": str(folder or Path.cwd()),
            "environment": dict(os.environ if environment is None else environment),
            "said": str(said),
            "complained": str(complained),
        }
        code, cpu_s = _server().ask(request)
        Spent.cpu_s += cpu_s
        done = subprocess.CompletedProcess(
            [target, *words], code, said.read_text(encoding="utf-8"), complained.read_text(encoding="utf-8")
        )
    if check and done.returncode:
        raise AssertionError(f"{' '.join(done.args)} ended with {done.returncode}:\n{done.stdout}\n{done.stderr}")
    return done


class _Server:
    """Process that forks the commands, and the pipes to it."""

    def __init__(self) -> None:
        code = Path(__file__).with_name("preloaded_server.py").read_text(encoding="utf-8")
        self.process = subprocess.Popen(
            [sys.executable, "-c", code], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
        )
        self.one_at_a_time = Lock()
        atexit.register(self.process.communicate)

    def ask(self, request: dict[str, object]) -> tuple[int, float]:
        """Return exit status and CPU time [s] of one command."""
        assert self.process.stdin is not None
        assert self.process.stdout is not None
        with self.one_at_a_time:
            self.process.stdin.write(json.dumps(request) + "\n")
            self.process.stdin.flush()
            answer = self.process.stdout.readline()
        assert answer, "the server of commands has ended"
        code, cpu_s = json.loads(answer)
        return code, cpu_s


@cache
def _server() -> _Server:
    return _Server()
