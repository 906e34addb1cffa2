"""Machine code kept on disk: the second start compiles nothing.

A file is code that will run with an arm in the machine: it is taken only from a folder that nobody else may write to,
and only if it is complete.
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
"""Beyond it the files that were not used for longest are removed."""


def folder() -> Path | None:
    """Where code is kept: of this user, by the XDG rules; nowhere for a user without a home."""
    base = Path(os.environ.get("XDG_CACHE_HOME", ""))
    if not base.is_absolute():
        try:
            base = Path.home() / ".cache"
        except RuntimeError:
            return None
    return base / "exograv" / "kernels" if base.is_absolute() else None


def key(*parts: str) -> str:
    """Name of what these parts determine, together with the compiler that is written in this room."""
    return blake2b("\n".join((*parts, _own_source())).encode(), digest_size=20).hexdigest()


def read(name: str) -> bytes | None:
    """Code kept under a name, or nothing."""
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
            _log.warning("%s is damaged; the kernel is compiled anew.", path)
            return None
        os.utime(path)
    except FileNotFoundError:
        return None
    except OSError as error:
        _log.info("No kernels from %s: %s.", path.parent, error.strerror)
        return None
    return code


def write(name: str, code: bytes) -> None:
    """Keep code under a name; a disk that is full or cannot be written to costs the next start its time, no more."""
    place = folder()
    if place is None:
        return
    try:
        place.mkdir(mode=0o700, parents=True, exist_ok=True)
        if not _is_ours_alone(place):
            return
        replace_file(place / name, _digest(name, code) + code, is_private=True)
        _make_room(place)
    except OSError as error:
        _log.info("Kernels are not kept in %s: %s.", place, error.strerror)


def _digest(name: str, code: bytes) -> bytes:
    """Of code and name: under another name it would be another function's."""
    return blake2b(name.encode() + code, digest_size=DIGEST_BYTES).digest()


def _make_room(place: Path) -> None:
    """Another process may do the same at the same time."""
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
    """Whether nobody else can have put code there."""
    if not hasattr(os, "getuid"):
        return True
    status = place.stat()
    ours = status.st_uid == os.getuid() and not status.st_mode & (stat.S_IWGRP | stat.S_IWOTH)
    if not ours:
        _log.warning("%s can be written by others; kernels are compiled anew. Correct it: chmod 700 %s", place, place)
    return ours


@cache
def _own_source() -> str:
    """Digest of everything here that decides what code comes out."""
    here = Path(__file__).parent
    names = ("emission.py", "module.py", "object_code.py", "operations.py", "text.py", "trigonometry.py", "program.py")
    digest = blake2b(digest_size=16)
    for name in names:
        digest.update((here / name).read_bytes())
    return digest.hexdigest()
