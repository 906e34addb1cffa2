"""What every command takes, and how figures get into a file."""

import json
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from exograv.errors import ConfigError, RecordingError
from exograv.options import AnySeed


@dataclass(frozen=True)
class Common:
    """What every command takes."""

    seed: AnySeed = 0

    json: Path | None = None
    """Write the figures to this file."""

    out: Path = Path("out")
    """Folder for recording and report."""


def refuse_unwritable(path: Path, option: str = "--json") -> None:
    """Try the file for the figures before a long run, and leave no trace of the trial.

    Raises:
        RecordingError: The file cannot be written.
    """
    is_new = not path.exists()
    _with_file(path, lambda: path.open("a").close(), option)
    if is_new:
        path.unlink()


def write_json(path: Path, result: dict[str, Any], option: str = "--json") -> None:
    """Write the figures.

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
    _with_file(path, lambda: path.write_text(text, encoding="utf-8"), option)


def _with_file(path: Path, act: Callable[[], object], option: str) -> None:
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        act()
    except OSError as error:
        raise RecordingError(f"{path} cannot be written: {error.strerror}. Give another path with {option}.") from error


def numbers(text: str, option: str) -> list[float]:
    """Numbers separated by commas.

    Raises:
        ConfigError: One of them is not a number.
    """
    try:
        return [float(part) for part in text.split(",")]
    except ValueError as error:
        raise ConfigError(f"{option} is '{text}'; give numbers separated by commas, without spaces.") from error


def whole_pair(text: str, option: str) -> tuple[int, int]:
    """Two whole numbers separated by a comma.

    Raises:
        ConfigError: They are not.
    """
    values = numbers(text, option)
    if len(values) != 2 or any(value != int(value) for value in values):
        raise ConfigError(f"{option} is '{text}'; give two whole numbers, such as 3,3.")
    return int(values[0]), int(values[1])


def named_number(text: str, option: str) -> tuple[str, float]:
    """NAME=VALUE.

    Raises:
        ConfigError: It is not.
    """
    name, equals, value = text.partition("=")
    try:
        if not equals:
            raise ValueError
        return name.strip(), float(value)
    except ValueError:
        raise ConfigError(f"{option} is '{text}'; give NAME=VALUE with a number, such as width=0.1.") from None
