"""Handling of Ctrl-C while a real machine moves: the interrupt is held until the arm has come down softly."""

import signal
import threading
from types import FrameType, TracebackType


class HeldInterrupt:
    """Context that holds Ctrl-C back while it is entered. Works in the main thread only."""

    def __init__(self, is_real: bool):
        """Prepare the context. Ctrl-C ends a simulated machine at once, because no arm can fall."""
        self.has_come = False
        self._takes = is_real and threading.current_thread() is threading.main_thread()

    def __enter__(self) -> "HeldInterrupt":
        if self._takes:
            self._before = signal.signal(signal.SIGINT, self._note)
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Restore the previous handling of Ctrl-C."""
        if self._takes:
            signal.signal(signal.SIGINT, self._before)

    def _note(self, _signal: int, _frame: FrameType | None) -> None:
        self.has_come = True
