"""Options of every command, and the file of its figures."""

import json
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from exograv.errors import RecordingError
from exograv.files import replace_file
from exograv.options import OUT


@dataclass(frozen=True)
class Common:
    """Options of every command."""

    json: Path | None = None
    """Write the figures to this file."""

    settings: Path | None = None
    """Read options from this TOML file. An option on the command line replaces that of the file."""

    write_settings: Path | None = None
    """Write the options in force to this TOML file, so that the run can be repeated with --settings."""


@dataclass(frozen=True)
class OutFolder(Common):
    """Options of a command that writes recordings, reports or pictures."""

    out: Path = OUT
    """Folder for recordings and reports."""


def refuse_unwritable(path: Path, option: str = "--json") -> None:
    """Check before a long run that a file can be written, and leave it unchanged.

    Raises:
        RecordingError: The file cannot be written.
    """
    is_new = not path.exists()
    _with_file(path, lambda: path.open("a").close(), option)
    if is_new:
        path.unlink()


def refuse_unwritable_json(path: Path) -> None:
    """Check before a long run that the figures can be written, and that they replace figures only.

    Raises:
        RecordingError: The file cannot be written, or holds something else than JSON.
    """
    refuse_unwritable(path)
    if not path.is_file() or not path.stat().st_size:
        return
    with path.open("rb") as file:
        begin = file.read(4096).lstrip()
    if not begin.startswith(b"{"):
        raise RecordingError(
            f"{path} holds something else than figures, and --json would replace it. Give another path."
        )


def write_json(path: Path, result: dict[str, Any], option: str = "--json") -> None:
    """Write the figures to a file.

    Raises:
        RecordingError: The file cannot be written, or a figure is not a number.
    """
    try:
        text = json.dumps(result, indent=1, ensure_ascii=False, allow_nan=False) + "\n"
    except ValueError as error:
        raise RecordingError(
            f"{path} is not written: a figure is infinite or not a number ({error}). The method diverged; "
            "the recording shows when."
        ) from error
    write_whole(path, text, option)


def write_whole(path: Path, text: str, option: str) -> None:
    """Write a file completely, or leave the old one as it was.

    Raises:
        RecordingError: The file cannot be written.
    """
    # A pipe or a device such as /dev/stdout cannot be replaced.
    is_file = path.is_file() or not path.exists()
    _with_file(path, lambda: replace_file(path, text) if is_file else path.write_text(text, encoding="utf-8"), option)


def _with_file(path: Path, act: Callable[[], object], option: str) -> None:
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        act()
    except OSError as error:
        raise RecordingError(f"{path} cannot be written: {error.strerror}. Give another path with {option}.") from error
