"""Compile the guard, and the loop around it, with the C compiler of this computer."""

import os
import shutil
import subprocess
from collections.abc import Sequence
from pathlib import Path

SOURCE = Path(__file__).with_name("core.c")

COMPILED_NAME = "guard.native"
"""File of the compiled guard, beside its source. Python would try to import a file whose ending is that of a module."""

FLAGS = ("-O2", "-std=c11", "-ffp-contract=off", "-fno-fast-math", "-fPIC", "-shared")
"""Contraction and fast mathematics would change the last bit of a torque, and could remove a test for NaN."""


def compiler() -> str | None:
    """Path of the C compiler: `CC`, or the first of cc, gcc and clang; None without any."""
    names = (os.environ.get("CC", ""), "cc", "gcc", "clang")
    return next((path for name in names if name and (path := shutil.which(name))), None)


def build(target: Path, sources: Sequence[Path] = (SOURCE,)) -> bool:
    """Compile the guard, or other sources, into `target`. False if this computer has no C compiler.

    Raises:
        subprocess.CalledProcessError: The compiler refused the source.
    """
    found = compiler()
    if found is None:
        return False
    made = target.with_suffix(f".{os.getpid()}.new")
    subprocess.run([found, *FLAGS, *map(str, sources), "-o", str(made), "-lm"], check=True)
    made.replace(target)
    return True
