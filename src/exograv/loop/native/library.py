"""Loader of the compiled tick in lock-step. Without it the same tick runs in Python."""

import ctypes
import os
from pathlib import Path

from exograv.safety.native import build
from exograv.safety.native.structs import layout_in

from . import record

COMPILED = Path(__file__).with_name("lock_step.native")
"""File of the compiled tick, beside its source."""

SOURCE = Path(__file__).with_name("lock_step.c")


def build_lock_step(target: Path = COMPILED) -> bool:
    """Compile the tick into `target`. False if this computer has no C compiler.

    Raises:
        subprocess.CalledProcessError: The compiler refused the source.
    """
    return build.build(target, (SOURCE,))


def load(path: Path = COMPILED) -> ctypes.PyDLL | None:
    """Load the compiled tick; None if there is no file, or if it was made from another layout of the record."""
    if not path.exists():
        return None
    library = ctypes.PyDLL(str(path))  # the lock of the interpreter stays: a tick is shorter than a switch of threads
    try:
        layout = ctypes.c_int64.in_dll(library, "lock_step_layout").value
    except ValueError:  # a library from before check sums
        return None
    if layout != layout_in(record.text()):
        return None
    library.lock_step_tick.argtypes, library.lock_step_tick.restype = [ctypes.c_void_p], ctypes.c_int64
    return library


LIBRARY = None if os.environ.get("EXOGRAV_LOCK_STEP") == "python" else load()
"""Compiled tick of this process; None if it is missing, or if EXOGRAV_LOCK_STEP=python asks for the tick in Python."""


if __name__ == "__main__":
    build_lock_step()
