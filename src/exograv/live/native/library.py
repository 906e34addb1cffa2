"""Loader of the compiled loop. Without it, or away from Linux, the guard's process runs its loop in Python."""

import ctypes
import os
import sys
from pathlib import Path

from exograv.rig.drives.canopen.native import record as can_record
from exograv.rig.drives.native import record as machine_record
from exograv.rig.drives.udp.native import record as udp_record
from exograv.safety.native import build
from exograv.safety.native.structs import layout_in

from . import record
from .record import HappeningPlace, LiveLoop, OrderPlace

COMPILED = Path(__file__).with_name("loop.native")
"""File of the compiled loop, beside its source."""

ROOT = Path(__file__).parents[2]
DRIVES = ROOT / "rig" / "drives"
SOURCES = (
    Path(__file__).with_name("loop.c"),
    DRIVES / "native" / "machine.c",
    DRIVES / "canopen" / "native" / "drives.c",
    DRIVES / "canopen" / "native" / "frames.c",
    DRIVES / "udp" / "native" / "drives.c",
)


def build_loop(target: Path = COMPILED) -> bool:
    """Compile the loop into `target`. False if this computer has no C compiler, or is no Linux computer.

    Raises:
        subprocess.CalledProcessError: The compiler refused the source.
    """
    return sys.platform.startswith("linux") and build.build(target, SOURCES)


def load(path: Path = COMPILED) -> ctypes.CDLL | None:
    """Load the compiled loop; None if there is no file, or if it was made from another layout of the records."""
    if not path.exists():
        return None
    library = ctypes.CDLL(str(path))
    try:
        layouts = (ctypes.c_int64 * 4).in_dll(library, "loop_layouts")
    except ValueError:  # a library from before check sums
        return None
    if list(layouts) != [layout_in(one.text()) for one in (record, machine_record, udp_record, can_record)]:
        return None
    loop, number = ctypes.POINTER(LiveLoop), ctypes.c_int64
    for name, (arguments, result) in {
        "run": ([], None),
        "tick": ([number], number),
        "order": ([ctypes.POINTER(OrderPlace)], number),
        "hear": ([ctypes.POINTER(HappeningPlace)], number),
        "end": ([], None),
        "beat": ([], None),
    }.items():
        function = getattr(library, f"loop_{name}")
        function.argtypes, function.restype = [loop, *arguments], result
    return library


LIBRARY = None if os.environ.get("EXOGRAV_LOOP") == "python" else load()
"""Compiled loop of this process; None if it is missing, or if EXOGRAV_LOOP=python asks for the loop in Python."""


if __name__ == "__main__":
    build_loop()
