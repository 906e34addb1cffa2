"""Compiled guard. `LIBRARY` is None where the package was installed without it; then the Python source runs."""

import ctypes
from pathlib import Path

from . import core
from .build import COMPILED_NAME

Library = ctypes.CDLL

COMPILED = Path(__file__).with_name(COMPILED_NAME)


def load(path: Path = COMPILED) -> Library | None:
    """Load the compiled guard; None if there is no file, or if it was made from another layout of the record."""
    if not path.exists():
        return None
    library = ctypes.CDLL(str(path))
    pointer = ctypes.c_void_p
    for name, arguments in {"see": 1, "decide": 2, "limit": 2, "reset": 1}.items():
        function = getattr(library, f"guard_{name}")
        function.argtypes, function.restype = [pointer] * arguments, ctypes.c_int if name == "reset" else None
    library.guard_carried.argtypes, library.guard_carried.restype = [pointer, pointer, ctypes.c_double], None
    return library if ctypes.c_long.in_dll(library, "guard_size").value == core.SIZE else None


LIBRARY = load()
