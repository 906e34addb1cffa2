"""Ctrl-C during a write: the interrupt waits until the file is consistent again."""

import contextlib
import signal
import threading
from collections.abc import Iterator
from types import FrameType


@contextlib.contextmanager
def uninterrupted() -> Iterator[None]:
    """Hold Ctrl-C back while the block runs, and pass it to the former handler afterwards. Main thread only."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    frames: list[FrameType | None] = []
    before = signal.signal(signal.SIGINT, lambda _signal, frame: frames.append(frame))
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, before)
        if frames and callable(before):
            before(signal.SIGINT, frames[0])
