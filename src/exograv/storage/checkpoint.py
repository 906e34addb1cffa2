"""Checkpoints: state of a long computation in a file, so that it can continue after an interruption.

Finished rows are appended to one file. A state is one file that each write replaces completely. Both kinds of file name
the computation they belong to, and another computation is refused.
"""

import contextlib
import json
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Generic, TypeVar

from pydantic import ValidationError

from exograv.errors import ConfigError, ExogravError, RecordingError
from exograv.files import append_rows, replace_file
from exograv.model.description import validation_sentences
from exograv.options import OptionRecord
from exograv.results import JsonObject

SIZE_MAX_BYTES = 20_000_000
"""Largest size of a state file, far above any state; a larger file is a mistake."""

Row = TypeVar("Row")
State = TypeVar("State")

NOT_SUCH = (KeyError, TypeError, ValueError)
"""Errors of a function that unpacks the data of another program."""


class CheckpointRows(Generic[Row]):
    """Rows of results in a file, one line of JSON each after a head line. `add` returns when the row is on the disk."""

    def __init__(
        self,
        path: Path,
        head: Mapping[str, Any],
        resume: bool,
        pack: Callable[[Row], Mapping[str, Any]],
        unpack: Callable[[JsonObject], Row],
    ):
        """Open the file; a file that is not resumed is kept beside it as `.before`.

        Args:
            path: The file; its name ends with .jsonl.
            head: Values that must be equal for rows to belong together.
            resume: True to continue after the rows in the file.
            pack: Function from a row to JSON values.
            unpack: Function from JSON values to a row; may raise `NOT_SUCH`.

        Raises:
            RecordingError: The file cannot be written, is damaged, or has another head.
        """
        self.path, self._head, self._pack, self._unpack = path, dict(head), pack, unpack
        self.rows: list[Row] = []
        """All finished rows, those of the resumed file first."""
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            if path.exists() and resume:
                self._read()
            else:
                if path.exists():
                    path.replace(path.with_suffix(".before.jsonl"))
                append_rows(path, [self._head])
        except OSError as error:
            raise self._not_written(error) from error

    def add(self, *rows: Row) -> None:
        """Append rows to the file.

        Raises:
            RecordingError: The file cannot be written, for example on a full disk.
        """
        try:
            append_rows(self.path, [self._pack(row) for row in rows])
        except OSError as error:
            raise self._not_written(error) from error
        self.rows.extend(rows)

    def _not_written(self, error: OSError) -> RecordingError:
        return RecordingError(f"{self.path} cannot be written: {error.strerror}. Give another folder with --out.")

    def _read(self) -> None:
        head, *lines = self.path.read_text(encoding="utf-8", errors="replace").splitlines() or [""]
        whole = _whole(lines)
        try:
            found = json.loads(head)
            rows = [json.loads(line) for line in whole]
        except json.JSONDecodeError as error:
            raise self._damaged(error) from error
        if found != self._head:
            asked = ", ".join(f"{name} {value}" for name, value in differing(found, self._head))
            raise RecordingError(
                f"{self.path} was made by something else ({head}; now {asked}). Leave out --resume, or choose another "
                "--out."
            )
        try:
            self.rows = [self._unpack(row) for row in rows]
        except NOT_SUCH as error:
            raise self._damaged(error) from error
        if len(whole) < len(lines):
            replace_file(self.path, "\n".join([head, *whole]) + "\n")

    def _damaged(self, error: Exception) -> RecordingError:
        return RecordingError(f"{self.path} is damaged ({error}). Leave out --resume; it is kept beside.")


def differing(found: object, wanted: Mapping[str, Any]) -> Iterator[tuple[str, Any]]:
    """Yield names and values of `wanted` that differ from those found."""
    for name, value in wanted.items():
        if not isinstance(found, Mapping) or found.get(name) != value:
            yield name, value


def _whole(lines: Sequence[str]) -> Sequence[str]:
    """Return the lines without a last line that was cut off in the middle."""
    try:
        json.loads(lines[-1] if lines else "{}")
    except json.JSONDecodeError:
        return lines[:-1]
    return lines


@dataclass(frozen=True)
class Advice:
    """Messages for the operator.

    They may contain {path}, {why}, the limit {most} and, for options that differ, {name}, {value} and {found}.
    """

    damaged: str
    too_large: str = ""
    unreadable: str = "{path} cannot be read: {why}. Check its permissions."
    other: str = ""
    unwritable: str = (
        "{path} cannot be written: {why}. What was there is unchanged. Free space, or give a folder that you may write."
    )
    unreadable_error: type[ExogravError] = ConfigError


@dataclass(frozen=True)
class StateFile(Generic[State]):
    """Format of a state in a file, and its messages."""

    pack: Callable[[State], str]
    unpack: Callable[[bytes], State]
    """Function from bytes to a state; may raise a `ValidationError` or `NOT_SUCH`."""

    advice: Advice
    is_private: bool = False
    """True if only the owner may read the file."""

    makes_folder: bool = True
    """True to create a missing folder; otherwise a missing folder is an error."""

    size_max: int | None = SIZE_MAX_BYTES
    """Largest size of the file; None for no limit."""

    def write(self, path: Path, state: State) -> None:
        """Replace the file, or leave the old one as it was.

        Raises:
            RecordingError: The file cannot be written.
        """
        try:
            if self.makes_folder:
                path.parent.mkdir(parents=True, exist_ok=True)
            replace_file(path, self.pack(state), is_private=self.is_private)
        except OSError as error:
            raise RecordingError(self.advice.unwritable.format(path=path, why=error.strerror)) from error

    def read(self, path: Path) -> State:
        """Return the state that was written last.

        Raises:
            ExogravError: The file cannot be read, or is damaged.
        """
        advice = self.advice
        try:
            if self.size_max is not None and path.stat().st_size > self.size_max:
                raise ConfigError(advice.too_large.format(path=path, most=self.size_max))
            return self.unpack(path.read_bytes())
        except OSError as error:
            raise advice.unreadable_error(advice.unreadable.format(path=path, why=error.strerror)) from error
        except NOT_SUCH as error:
            why = validation_sentences(error) if isinstance(error, ValidationError) else error
            raise ConfigError(advice.damaged.format(path=path, why=why)) from error

    def find(self, path: Path) -> State | None:
        """Return the state that was written last; None if there is no file.

        Raises:
            ExogravError: The file cannot be read, or is damaged.
        """
        with contextlib.suppress(PermissionError):  # `read` then gives the reason
            if not path.exists():
                return None
        return self.read(path)

    def refuse_other(self, path: Path, found: OptionRecord, wanted: OptionRecord) -> None:
        """Refuse a state of other options.

        Raises:
            ConfigError: An option differs; the message names the first one.
        """
        for name, value in differing(found, wanted):
            raise ConfigError(self.advice.other.format(path=path, name=name, value=value, found=found.get(name)))
