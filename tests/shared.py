"""Long preparations that are made once: for all workers of a run, and again only after a change of the source.

A demonstration, a session or a study that many tests only read is kept below pytest's cache. Its name contains a hash
of all that could change it: sources, machines, wearers, packages, its own options, and the test file that makes it.
"""

import hashlib
import os
import platform
import shutil
import time
from collections.abc import Callable
from functools import cache
from importlib.metadata import distributions
from pathlib import Path
from types import FunctionType

from tests.waiting import wait_until

ROOT = Path(__file__).parents[1]
SOURCES = ("src/exograv", "robots", "examples/wearers", "tests/preloaded_server.py")
FOLDER = "exograv-prepared"
COMPLETE = "complete"
"""File that says that a preparation came to its end, with the same source at its beginning and at its end."""

KEPT_S = 86400.0
"""Age after which what another state of the source prepared is removed [s]: a run beside this one may still read it."""

PREPARED_WITHIN_S = 1800.0
"""Time limit for another worker's preparation on a busy computer [s]."""

Prepare = FunctionType
"""Function that fills an empty folder, whose path is its argument."""


def prepared(parent: Path, words: tuple[str, ...], prepare: Prepare, source: Callable[[], str] | None = None) -> Path:
    """Return a folder with what `prepare` wrote into it, now or before. Tests only read it.

    Args:
        parent: Folder that all workers use.
        words: All options of the preparation, its seed among them.
        prepare: Function that fills the empty folder; its file is part of the name.
        source: Function that returns a hash of the source; that of the whole project if not given.
    """
    source = source or source_hash
    key = hash_at_first() if source is source_hash else source()
    _remove_old(parent, key)
    maker = Path(prepare.__code__.co_filename).read_bytes()
    folder = parent / key / hashlib.sha256("\0".join(words).encode() + b"\0" + maker).hexdigest()[:16]
    folder.parent.mkdir(parents=True, exist_ok=True)
    lock = os.open(folder.with_suffix(".lock"), os.O_RDWR | os.O_CREAT, 0o600)
    try:
        wait_until(lambda: _taken(lock), f"the lock of {' '.join(words)}", PREPARED_WITHIN_S, every_s=0.1)
        if not (folder / COMPLETE).exists():
            shutil.rmtree(folder, ignore_errors=True)
            folder.mkdir()
            prepare(folder)
            if source() == key:
                (folder / COMPLETE).write_text("\n".join(words), encoding="utf-8")
    finally:
        os.close(lock)
    return folder


def _taken(lock: int) -> bool:
    # A module of exograv that is imported before the tests begin would escape the checks of shapes.
    from exograv.study.folder.folder_lock import take_lock

    try:
        take_lock(lock)
    except BlockingIOError:
        return False
    return True


def _remove_old(parent: Path, key: str) -> None:
    for other in parent.iterdir() if parent.exists() else ():
        if other.name != key and other.stat().st_mtime < time.time() - KEPT_S:
            shutil.rmtree(other, ignore_errors=True)


def source_hash() -> str:
    """Hash of the files, the packages and the processor that decide a preparation."""
    digest = hashlib.sha256(_surroundings().encode())
    for path in sorted(file for source in SOURCES for file in _files(ROOT / source)):
        digest.update(str(path.relative_to(ROOT)).encode() + b"\0" + hashlib.sha256(path.read_bytes()).digest())
    return digest.hexdigest()[:16]


def _files(path: Path) -> list[Path]:
    if path.is_file():
        return [path]
    return [file for file in path.rglob("*") if file.is_file() and "__pycache__" not in file.parts]


@cache
def _surroundings() -> str:
    packages = sorted(f"{one.name}=={one.version}" for one in distributions())
    return "\n".join([platform.python_version(), platform.platform(), platform.processor(), *packages])


@cache
def hash_at_first() -> str:
    """Hash of the source when this process asked first, which is before it starts a server of commands."""
    return source_hash()
