"""Disk cache of machine code, so that the second start compiles nothing.

A file is code that will run with an arm in the machine. It is used only if it is complete, and only from a folder that
no other user may write to.
"""

import contextlib
import logging
import os
import stat
from functools import cache
from hashlib import blake2b
from pathlib import Path

from exograv.files import replace_file

_log = logging.getLogger(__name__)

DIGEST_BYTES = 32
KEPT_BYTES = 300e6
"""Size of the cache above which the least recently used files are removed."""


def folder() -> Path | None:
    """Return the folder of this user's cache by the XDG rules; None for a user without a home."""
    base = Path(os.environ.get("XDG_CACHE_HOME", ""))
    if not base.is_absolute():
        try:
            base = Path.home() / ".cache"
        except RuntimeError:
            return None
    return base / "exograv" / "kernels" if base.is_absolute() else None


def key(*parts: str) -> str:
    """Name of the file for these parts and the present source of the compiler in this room."""
    return blake2b("\n".join((*parts, _own_source())).encode(), digest_size=20).hexdigest()


def read(name: str) -> bytes | None:
    """Read the code under a name; None if there is none."""
    place = folder()
    if place is None:
        return None
    path = place / name
    try:
        if not _is_ours_alone(path.parent):
            return None
        content = path.read_bytes()
        digest, code = content[:DIGEST_BYTES], content[DIGEST_BYTES:]
        if _digest(name, code) != digest:
            _log.warning("%s is damaged; the kernel is compiled again.", path)
            return None
        os.utime(path)
    except FileNotFoundError:
        return None
    except OSError as error:
        _log.info("No kernels from %s: %s.", path.parent, error.strerror)
        return None
    return code


def write(name: str, code: bytes) -> None:
    """Write code under a name.

    If the disk is full or read-only, only the next start takes longer.
    """
    place = folder()
    if place is None:
        return
    try:
        place.mkdir(mode=0o700, parents=True, exist_ok=True)
        if not _is_ours_alone(place):
            return
        replace_file(place / name, _digest(name, code) + code, is_private=True)
        if name.endswith("0"):  # one file of 16: looking through the whole folder takes longer than to write a file
            _make_room(place)
    except OSError as error:
        _log.info("Kernels cannot be stored in %s: %s.", place, error.strerror)


def _digest(name: str, code: bytes) -> bytes:
    """Digest of code and name, so that code under another name, of another function, is not accepted."""
    return blake2b(name.encode() + code, digest_size=DIGEST_BYTES).digest()


def _make_room(place: Path) -> None:
    """Remove the least recently used files above `KEPT_BYTES`; another process may do so at the same time."""
    files = []
    for path in place.iterdir():
        with contextlib.suppress(FileNotFoundError):
            status = path.stat()
            files.append((status.st_mtime, status.st_size, path))
    excess = sum(size for _, size, _ in files) - KEPT_BYTES
    for _, size, path in sorted(files):
        if excess <= 0:
            break
        path.unlink(missing_ok=True)
        excess -= size


def _is_ours_alone(place: Path) -> bool:
    """Return True if no other user can have put code there."""
    if not hasattr(os, "getuid"):
        return True
    status = place.stat()
    ours = status.st_uid == os.getuid() and not status.st_mode & (stat.S_IWGRP | stat.S_IWOTH)
    if not ours:
        _log.warning("%s can be written by others; kernels are compiled again. Correct it: chmod 700 %s", place, place)
    return ours


@cache
def _own_source() -> str:
    """Digest of the sources in this room that determine the code."""
    here = Path(__file__).parent
    names = ("emission.py", "module.py", "object_code.py", "operations.py", "text.py", "trigonometry.py", "program.py")
    digest = blake2b(digest_size=16)
    for name in names:
        digest.update((here / name).read_bytes())
    return digest.hexdigest()
