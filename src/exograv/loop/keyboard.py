"""Lines typed at the keyboard, waited for no longer than asked."""

import queue
import select
import sys
import threading
from functools import cache
from typing import TextIO


def is_line_typed(answers: TextIO, within_s: float) -> bool:
    """True if Enter was pressed, or is pressed within this time [s]; the line is taken."""
    if sys.platform == "win32":  # `select` knows only sockets there
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
    """Lines of a stream, read by a thread of its own."""
    lines: queue.SimpleQueue[str] = queue.SimpleQueue()

    def read() -> None:
        for line in answers:
            lines.put(line)

    threading.Thread(target=read, daemon=True).start()
    return lines
