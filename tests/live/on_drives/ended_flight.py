"""Command over simulated drives that meets an ending in the middle of its procedure, in a process of its own.

    python -m tests.live.on_drives.ended_flight ENDING SECONDS JOINT WORDS...

`ENDING` is "ctrl-c", "control-dies" or "guard-stops" (the cable of `JOINT` is pulled). It comes `SECONDS` of the
machine's time after the arm is learned.
"""

import contextlib
import os
import signal
import sys
from collections.abc import Callable, Iterator
from functools import partial
from multiprocessing.shared_memory import SharedMemory
from pathlib import Path
from typing import Any
from unittest.mock import patch

from exograv.cli import main
from exograv.live.live_processes import Running
from exograv.live.on_drives import float_command, guided, mirror, weighing
from exograv.procedures.bring_up.hands import Hands

SHARED, LEFT = Path("/dev/shm"), "Shared memory that is left: "


def ends(ending: str, seconds: float, joint: str) -> Callable[[Running, Hands], None]:
    """Return the function that watches the run and brings about its ending, once."""
    learned_at, is_over = list[float](), False

    def act(running: Running, hands: Hands) -> None:
        nonlocal is_over
        if is_over or running.worker is None or running.worker.learned is None:
            return
        shown = running.states.read()
        if shown is None:
            return
        now = float(shown[1]["now"])
        learned_at[:] = learned_at or [now]
        if now - learned_at[0] < seconds:
            return
        is_over = True
        if ending == "ctrl-c":
            os.kill(os.getpid(), signal.SIGINT)
        elif ending == "control-dies":
            os.kill(running.control.pid, signal.SIGKILL)
        else:
            hands.pull_cable(joint)

    return act


def run(ending: str, seconds: str, joint: str, *words: str) -> None:
    """Run a command with this ending."""
    ended = partial(float_command.Procedure, acts=ends(ending, float(seconds), joint))
    with contextlib.ExitStack() as stack:
        for module in (guided, mirror, weighing):
            stack.enter_context(patch.object(module, "Procedure", ended))
        # A shell lets its background commands ignore Ctrl-C, and they pass this on to the tests.
        signal.signal(signal.SIGINT, signal.default_int_handler)
        made = stack.enter_context(noted_memory())
        sys.argv = ["exograv", *words]
        try:
            main()
        finally:
            print(f"{LEFT}{[name for name in made if (SHARED / name).exists()]}")


@contextlib.contextmanager
def noted_memory() -> Iterator[list[str]]:
    """Yield a list to which the name of each new shared memory is added."""
    made, original = list[str](), SharedMemory.__init__

    def noting(self: SharedMemory, *args: Any, **options: Any) -> None:
        original(self, *args, **options)
        if options.get("create"):
            made.append(self.name)

    with patch.object(SharedMemory, "__init__", noting):
        yield made


if __name__ == "__main__":
    run(*sys.argv[1:])
