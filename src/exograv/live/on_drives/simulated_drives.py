"""Simulated drives in another process, and simulated hands that write to their bench."""

import contextlib
import queue
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator, Sequence

from exograv.errors import RigError
from exograv.runtime.processes.spawn import end_signals_ignored

READY_MAX_S = 120.0
"""Time-out for the start of the simulated drives [s]."""

DONE_MAX_S = 10.0
"""Time-out for one action at the bench [s]."""

GREETING, DONE = "Simulated drives of", "done: "


@contextlib.contextmanager
def simulated_drives(bus: str, options: Sequence[str]) -> Iterator[Callable[[str], None]]:
    """Run `exograv dev drive-sim` in another process; yield a function that performs one action at its bench.

    Raises:
        RigError: The process does not start, or does not perform an action; the message has its output.
    """
    command = [sys.executable, "-m", "exograv.cli", "dev", "drive-sim", "--bus", bus, "--ends-with-input", *options]
    # Ctrl-C and SIGHUP reach every process of the terminal: the machine must still answer while the arm comes down.
    with end_signals_ignored():
        process = subprocess.Popen(
            command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, bufsize=1,
            start_new_session=True,
        )  # fmt: skip
    assert process.stdin is not None
    assert process.stdout is not None
    said: queue.Queue[str] = queue.Queue()
    lines, keys = process.stdout, process.stdin
    reader = threading.Thread(target=lambda: [said.put(line) for line in lines], daemon=True)
    reader.start()
    try:
        _await(GREETING, process, said, READY_MAX_S)

        def tell(line: str) -> None:
            with contextlib.suppress(OSError):  # The process has ended: `_await` reports it.
                keys.write(f"{line}\n")
                keys.flush()
            _await(DONE, process, said, DONE_MAX_S)

        yield tell
    except RigError as error:
        if (status := process.poll()) is None:
            raise
        reader.join(1.0)
        raise RigError(
            f"{error} The simulated drives had ended (exit status {status}). Their last message: {_last(said)}"
        ) from error
    finally:
        with contextlib.suppress(OSError):
            keys.write("quit\n")
        with contextlib.suppress(OSError):
            keys.close()
        try:
            process.wait(5.0)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()
        reader.join(1.0)
        lines.close()


def _last(said: "queue.Queue[str]") -> str:
    """Last line that is not empty."""
    lines = [line.strip() for line in said.queue if line.strip()]
    return lines[-1].removeprefix("exograv: ") if lines else "none."


def _await(words: str, process: "subprocess.Popen[str]", said: "queue.Queue[str]", most_s: float) -> None:
    heard, until = "", time.monotonic() + most_s
    while words not in heard:
        try:
            heard += said.get(timeout=0.2)
        except queue.Empty:
            if process.poll() is not None or time.monotonic() > until:
                raise RigError(
                    f"The simulated drives do not answer as expected. Their output: {heard.strip() or 'nothing'}"
                ) from None
