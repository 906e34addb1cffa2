"""Lines from the keyboard, read with a time-out."""

import queue
import select
import sys
import threading
from functools import cache
from typing import TextIO


def is_line_typed(answers: TextIO, within_s: float) -> bool:
    """Return True if Enter was pressed, or is pressed within this time [s]. The line is consumed."""
    if sys.platform == "win32":  # On Windows, `select` accepts sockets only.
        try:
            _typed(answers).get(within_s > 0.0, within_s or None)
        except queue.Empty:
            return False
        return True
    if not select.select([answers], [], [], within_s)[0]:
        return False
    answers.readline()
    return True


@cache
def _typed(answers: TextIO) -> "queue.SimpleQueue[str]":
    """Lines of a stream, read by a separate thread."""
    lines: queue.SimpleQueue[str] = queue.SimpleQueue()

    def read() -> None:
        for line in answers:
            lines.put(line)

    threading.Thread(target=read, daemon=True).start()
    return lines
