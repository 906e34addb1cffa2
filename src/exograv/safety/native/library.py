"""Loader of the compiled guard. Without it the Python source of the guard runs."""

import ctypes
import os
from pathlib import Path

from .build import COMPILED_NAME
from .structs import check_sum

Library = ctypes.CDLL

COMPILED = Path(__file__).with_name(COMPILED_NAME)
SOURCE = Path(__file__).with_name("core.py")


def source_sum() -> int:
    """Return the check sum (CRC-32) of the guard's source: the version of the guard."""
    return check_sum(SOURCE.read_text(encoding="utf-8"))


def load(path: Path = COMPILED) -> Library | None:
    """Load the compiled guard; None if there is no file, or if it was made from another source."""
    if not path.exists():
        return None
    library = ctypes.CDLL(str(path))
    try:
        made_from = ctypes.c_longlong.in_dll(library, "guard_source").value
    except ValueError:  # a library from before check sums
        return None
    if made_from != source_sum():
        return None
    pointer = ctypes.c_void_p
    for name, arguments in {"see": 1, "decide": 2, "limit": 2, "reset": 1}.items():
        function = getattr(library, f"guard_{name}")
        function.argtypes, function.restype = [pointer] * arguments, ctypes.c_int if name == "reset" else None
    library.guard_carried.argtypes, library.guard_carried.restype = [pointer, pointer, ctypes.c_double], None
    return library


LIBRARY = None if os.environ.get("EXOGRAV_GUARD") == "source" else load()
"""Compiled guard of this process; None if it is missing, or if EXOGRAV_GUARD=source asks for the Python source."""

NOT_COMPILED = (
    "the guard is not compiled on this computer. It runs as Python, for simulations only. Install a C compiler, then "
    "exograv again."
)
"""Sentence for an operator or a visitor, after a colon."""
