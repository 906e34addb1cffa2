"""Signals that end a command: SIGTERM, SIGHUP and SIGQUIT act like Ctrl-C.

A real machine then comes down softly, a write is completed, and a bring-up seals its sheet: the same code handles all
four signals.
"""

import contextlib
import errno
import os
import signal
import sys
import threading
from collections.abc import Iterator
from types import FrameType

SIGHUP = getattr(signal, "SIGHUP", None)
"""Signal of a closed terminal; None on Windows."""

ENDING = tuple(getattr(signal, name) for name in ("SIGTERM", "SIGHUP", "SIGQUIT") if hasattr(signal, name))


class EndSignals:
    """Context in which these signals call the present handler of Ctrl-C. It acts in the main thread only.

    A signal that is ignored at the start stays ignored, as `nohup` and a simulated drive need it.
    """

    def __init__(self) -> None:
        self.came: signal.Signals | None = None
        """Last of these signals that came."""

    def __enter__(self) -> "EndSignals":
        self._before = {}
        if threading.current_thread() is not threading.main_thread():
            return self
        streams = (sys.__stdout__, sys.__stderr__)
        self._terminals = [stream.fileno() for stream in streams if stream is not None and stream.isatty()]
        heeded = [number for number in ENDING if signal.getsignal(number) is not signal.SIG_IGN]
        for number in heeded:
            self._before[number] = signal.signal(number, self._act)
        if heeded and signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
            # A shell lets its background commands ignore Ctrl-C. They must still be able to end softly.
            self._before[signal.SIGINT] = signal.signal(signal.SIGINT, self._act_in_background)
        return self

    def __exit__(self, *_: object) -> None:
        """Restore the former handlers."""
        for number, handler in self._before.items():
            signal.signal(number, handler)

    def _act(self, number: int, frame: FrameType | None) -> None:
        if number == SIGHUP:
            self._leave_terminals()
            if self.came is not None:
                return  # a closed terminal usually sends SIGHUP twice: from the shell, and from the kernel
        self.came = signal.Signals(number)
        handler = signal.getsignal(signal.SIGINT)
        if callable(handler):
            handler(signal.SIGINT, frame)
        else:
            raise KeyboardInterrupt

    def _act_in_background(self, _number: int, _frame: FrameType | None) -> None:
        if self.came is not None:
            raise KeyboardInterrupt

    def _leave_terminals(self) -> None:
        """Write to nowhere instead of to a closed terminal: an error of a print must not end the soft descent."""
        nowhere = os.open(os.devnull, os.O_WRONLY)
        for number in self._terminals:
            os.dup2(nowhere, number)
        os.close(nowhere)


@contextlib.contextmanager
def terminal_may_close() -> Iterator[None]:
    """Treat the write error of a closed terminal as SIGHUP: the error can come before the signal."""
    try:
        yield
    except OSError as error:
        if error.errno != errno.EIO or SIGHUP is None:
            raise
        signal.raise_signal(SIGHUP)
