"""Ctrl-C while a real machine moves: kept until it has come down softly."""

import signal
import threading
from types import FrameType, TracebackType


class HeldInterrupt:
    """Takes Ctrl-C for as long as it is entered, where it can: in the main thread."""

    def __init__(self, is_real: bool):
        """Of a machine that is only computed nothing is held: it may end anywhere."""
        self.has_come = False
        self._takes = is_real and threading.current_thread() is threading.main_thread()

    def __enter__(self) -> "HeldInterrupt":
        if self._takes:
            self._before = signal.signal(signal.SIGINT, self._note)
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Ctrl-C works again as before."""
        if self._takes:
            signal.signal(signal.SIGINT, self._before)

    def _note(self, _signal: int, _frame: FrameType | None) -> None:
        self.has_come = True
