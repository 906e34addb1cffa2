"""A bring-up without hardware: simulated drives in another process, and hands that write to their bench."""

import contextlib
import queue
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator, Sequence

from exograv.errors import RigError

READY_MAX_S = 120.0
DONE_MAX_S = 10.0
GREETING, DONE = "Simulated drives of", "done: "


@contextlib.contextmanager
def simulated_drives(bus: str, options: Sequence[str]) -> Iterator[Callable[[str], None]]:
    """`exograv drive-sim` in another process; what has a line done at its bench.

    Raises:
        RigError: It does not begin, or does not do what it is told; with what it has said.
    """
    command = [sys.executable, "-m", "exograv.cli", "drive-sim", bus, *options]
    process = subprocess.Popen(
        command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, bufsize=1
    )
    assert process.stdin is not None
    assert process.stdout is not None
    said: queue.Queue[str] = queue.Queue()
    lines, keys = process.stdout, process.stdin
    reader = threading.Thread(target=lambda: [said.put(line) for line in lines], daemon=True)
    reader.start()
    try:
        _await(GREETING, process, said, READY_MAX_S)

        def tell(line: str) -> None:
            keys.write(f"{line}\n")
            keys.flush()
            _await(DONE, process, said, DONE_MAX_S)

        yield tell
    finally:
        with contextlib.suppress(OSError):
            keys.write("quit\n")
            keys.close()
        try:
            process.wait(5.0)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()
        reader.join(1.0)
        lines.close()


def _await(words: str, process: "subprocess.Popen[str]", said: "queue.Queue[str]", most_s: float) -> None:
    heard, until = "", time.monotonic() + most_s
    while words not in heard:
        try:
            heard += said.get(timeout=0.2)
        except queue.Empty:
            if process.poll() is not None or time.monotonic() > until:
                raise RigError(
                    f"The simulated drives do not do what they are told. They said: {heard.strip() or 'nothing'}"
                ) from None
