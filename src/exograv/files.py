"""Atomic writes of files, appended rows of JSON, and values as TOML."""

import errno
import json
import os
import secrets
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from typing import Any

from .errors import RecordingError

PARTIAL = ".partial-"
"""Start of an unfinished file's name. A process that is killed leaves such a file behind; no reader opens it."""

NO_ROOM = frozenset({errno.ENOSPC, errno.EDQUOT, errno.EFBIG})
"""Errors of a full disk, a used-up quota, and a size limit."""

Content = str | bytes | Callable[[Path], None]
"""Text, bytes, or a function that fills the file at a path."""


def replace_file(path: Path, content: Content, *, is_private: bool = False) -> None:
    """Write a temporary file beside `path`, force it to the disk and give it the name `path`.

    Args:
        path: The file, in a folder that exists.
        content: New content.
        is_private: True if only its owner may read the file.

    Raises:
        OSError: The file cannot be written. The old content is unchanged.
    """
    # The suffix keeps an unfinished file out of every search by suffix.
    partial = path.with_name(f"{PARTIAL}{secrets.token_hex(4)}-{path.name}.part")
    try:
        if callable(content):
            content(partial)
        else:
            _write(partial, content, 0o600 if is_private else 0o666)
        sync(partial)
        partial.replace(path)
        sync(path.parent)
    finally:
        partial.unlink(missing_ok=True)  # after an error or Ctrl-C


def write_whole(path: Path, content: Content, *, is_private: bool = False) -> None:
    """Create the folder of a file and replace the file, with an error message for the operator.

    Raises:
        RecordingError: The disk is full, or the folder cannot be written.
    """
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        replace_file(path, content, is_private=is_private)
    except OSError as error:
        raise RecordingError(
            f"{path} cannot be written: {error.strerror}. The old file is unchanged. Free disk space, or give a folder "
            "with write permission."
        ) from error


def sync(path: Path) -> None:
    """Force the content of a file, or the names in a folder, to the disk."""
    if os.name == "nt":  # Windows opens no folder, and it flushes no file that is open for reading only.
        return
    handle = os.open(path, os.O_RDONLY)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)


def append_rows(path: Path, rows: Iterable[Mapping[str, Any]]) -> None:
    """Append rows to a file, one line of JSON per row, and force them to the disk.

    If a killed process left an unfinished line, the new rows start on a new line.

    Raises:
        OSError: The file cannot be written.
    """
    text = "".join(json.dumps(row, ensure_ascii=False) + "\n" for row in rows).encode()
    with path.open("ab+") as file:
        size = file.seek(0, os.SEEK_END)
        if size:
            file.seek(size - 1)
            text = text if file.read(1) == b"\n" else b"\n" + text
        file.write(text)
        file.flush()
        os.fsync(file.fileno())


def toml_text(content: Mapping[str, Any], head: str = "") -> str:
    """Text of values in TOML, below the comment lines `head`."""
    # Importing the package stays fast: only a writer of TOML loads the library.
    import tomlkit

    return head + tomlkit.dumps(content)


def toml_value(value: Any) -> str:
    """Text of a single value in TOML: a quoted string, a number or a list."""
    import tomlkit

    return tomlkit.item(value).as_string()


def _write(path: Path, content: str | bytes, mode: int) -> None:
    data = content.encode() if isinstance(content, str) else content
    with os.fdopen(
        os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL | getattr(os, "O_BINARY", 0), mode), "wb"
    ) as file:
        file.write(data)
