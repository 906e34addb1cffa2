"""File of a recording on the disk: opened, its name synced, and a sentence for each error."""

import errno
import os
from pathlib import Path
from typing import BinaryIO

from exograv.errors import RecordingError

NO_ROOM = frozenset({errno.ENOSPC, errno.EDQUOT, errno.EFBIG})
"""Errors that free space on the disk would solve."""


def opened(path: Path, mode: str) -> BinaryIO:
    """Open a file for writing; its folder is created too.

    Raises:
        RecordingError: The file cannot be opened.
    """
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        return path.open(mode)  # pyright: ignore[reportReturnType]  # both modes are binary
    except OSError as error:
        raise RecordingError(unwritable(path, error)) from error


def sync_folder(path: Path) -> None:
    """Force the name of a file into its folder on the disk."""
    folder = os.open(path.parent, os.O_RDONLY)
    try:
        os.fsync(folder)
    finally:
        os.close(folder)


def unwritable(path: Path, error: OSError) -> str:
    """Return a sentence on a recording that cannot be written, with what to do."""
    advice = "Free some space there, or give" if error.errno in NO_ROOM else "Give"
    failing = "The disk fails; do not use it again. " if error.errno == errno.EIO else ""
    return (
        f"The recording {path} cannot be written: {error.strerror}. {failing}{advice} another folder with --out. "
        "What was on the disk before stays readable."
    )
