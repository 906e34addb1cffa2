"""Bytes of a recording, read from the file on demand."""

import contextlib
import os
import struct
from collections.abc import Iterator
from pathlib import Path
from typing import BinaryIO

from mcap.writer import MCAP0_MAGIC

from exograv.errors import RecordingError


class FileContent:
    """Bytes of an open file, read on demand; a failing disk raises a `RecordingError`."""

    def __init__(self, path: Path, file: BinaryIO):
        """Take the size of the file at this moment."""
        self._path, self._file = path, file
        self._size = os.fstat(file.fileno()).st_size

    def __len__(self) -> int:
        return self._size

    def __getitem__(self, part: slice, /) -> bytes:
        start, stop, _ = part.indices(self._size)
        try:
            self._file.seek(start)
            return self._file.read(max(stop - start, 0))
        except OSError as error:
            raise RecordingError(_unreadable(self._path, error)) from error


@contextlib.contextmanager
def read_content(path: Path) -> Iterator[FileContent]:
    """Open the bytes of an MCAP file for the duration of the block.

    Raises:
        RecordingError: The file is missing, or of another kind.
    """
    try:
        file = path.open("rb")
    except OSError as error:
        raise RecordingError(_unreadable(path, error)) from error
    with file:
        content = FileContent(path, file)
        if content[: len(MCAP0_MAGIC)] != MCAP0_MAGIC:
            raise RecordingError(
                f"{path} is not an MCAP file. A recording of exograv ends in .mcap and begins with its mark."
            )
        yield content


FOREIGN = (ValueError, KeyError, TypeError, AttributeError, IndexError, OverflowError, RecursionError, struct.error)
"""Errors that a message with a right check sum can raise if another program has written it."""


@contextlib.contextmanager
def foreign_messages_refused(path: Path) -> Iterator[None]:
    """Refuse a file whose chunks are good, but whose messages are not those of exograv's writer.

    Raises:
        RecordingError: A message in the block could not be understood.
    """
    try:
        yield
    except FOREIGN as error:
        raise RecordingError(
            f"{path} has a message that no version of exograv writes ({type(error).__name__}: {error}). Another "
            "program has changed the file: take the copy that exograv wrote."
        ) from error


def _unreadable(path: Path, error: OSError) -> str:
    return f"The recording {path} cannot be read: {error.strerror}. Check its path."
