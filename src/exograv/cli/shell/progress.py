"""Progress of a command on standard error: a bar on a terminal, else lines of text."""

import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from threading import Event, Lock, Thread

from .command import estimate
from .end_signals import terminal_may_close

LINE_EVERY_S = 2.0
"""Shortest time between two lines of progress where standard error is not a terminal [s]."""

SILENT_MAX_S = 15.0
"""Longest time without a line where standard error is not a terminal [s]."""

FIRST_LINE_S = 2.0
"""Time before the first line of a command that checks its files while it reads them [s]."""

STARTING, STARTS_S = "Starting", 5.0
"""Phase before the first one, and the time before its line [s]; most wrong input is refused earlier, in one line."""

BEAT_S = 0.5
"""Time between two looks of the thread that ends the silence [s]."""

Show = Callable[[str, float], None]


@contextmanager
def bars(first_line_s: float = 0.0) -> Iterator[Show]:
    """Show the usual duration and the progress of a command.

    On a terminal a bar shows the phase. Elsewhere each phase has one line, and a long phase one line every 15 s.

    Args:
        first_line_s: Time before the first line of text, so that a refused file is answered in one line [s].

    Yields:
        Function of the phase, as a text, and the share of it that is done.
    """
    if not sys.stderr.isatty():
        with _lines(first_line_s) as show:
            yield show
        return
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

    columns = (TextColumn("{task.description}"), BarColumn(bar_width=24), TimeElapsedColumn())
    # Rich would print standard output on the console of the bar, even if it goes to a file.
    on_terminal = sys.stdout.isatty()
    with Progress(*columns, console=Console(stderr=True), transient=True, redirect_stdout=on_terminal) as progress:
        if sentence := estimate.get():
            progress.console.print(sentence, highlight=False, markup=False)
        task, current = progress.add_task("Starting", total=1.0), ""

        def draw(text: str, share: float) -> None:
            nonlocal current
            with terminal_may_close():
                if text != current:
                    current = text
                    progress.reset(task, description=text)
                progress.update(task, completed=share)

        yield draw


@contextmanager
def _lines(first_line_s: float) -> Iterator[Show]:
    lines, ended = Lines(estimate.get(), first_line_s, time.monotonic), Event()

    def look() -> None:
        while not ended.wait(BEAT_S):
            lines.look()

    # A phase may be one long call of compiled code, so a thread of its own ends the silence.
    thread = Thread(target=look, daemon=True)
    thread.start()
    try:
        yield lines.show
    finally:
        ended.set()
        thread.join(BEAT_S)


class Lines:
    """Lines of progress for a file or a pipe."""

    def __init__(self, sentence: str, first_line_s: float, clock: Callable[[], float]):
        """Begin with the sentence on the usual duration, which is printed with the first phase."""
        self._sentence, self._first_line_s, self._clock = sentence, first_line_s, clock
        self._start, self._said, self._lock = clock(), -LINE_EVERY_S, Lock()
        self._phase, self._share, self._is_new = STARTING, 0.0, True

    def show(self, phase: str, share: float) -> None:
        """Set phase and share; print a line if the phase is new and the last line is not too recent."""
        with self._lock:
            self._is_new, self._phase, self._share = self._is_new or phase != self._phase, phase, share
            self._say_if_due()

    def look(self) -> None:
        """Print a line if none was printed for a long time."""
        with self._lock:
            self._say_if_due()

    def _say_if_due(self) -> None:
        elapsed = self._clock() - self._start
        silent = elapsed - self._said
        if elapsed < (STARTS_S if self._phase == STARTING else self._first_line_s):
            return
        if not (self._is_new and silent >= LINE_EVERY_S) and silent < SILENT_MAX_S:
            return
        share = "" if self._is_new or not 0.0 < self._share < 1.0 else f", {100 * self._share:.0f} %"
        with terminal_may_close():
            if self._sentence:
                print(self._sentence, file=sys.stderr)
                self._sentence = ""
            print(f"[{elapsed:5.0f} s] {self._phase}{share}", file=sys.stderr, flush=True)
        self._said, self._is_new = elapsed, False
