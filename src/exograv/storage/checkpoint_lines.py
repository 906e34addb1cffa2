"""Rows of a long computation, kept as they are done: what was interrupted goes on with them."""

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from exograv.errors import RecordingError


class KeptLines:
    """Rows, one a line of JSON after a line that says what made them."""

    def __init__(self, path: Path, head: Mapping[str, Any], resume: bool):
        """Open; a file that is not resumed is kept beside as `.before`.

        Args:
            path: Of the file; its name ends with .jsonl.
            head: What has to be the same for rows to belong together.
            resume: Whether to go on with the rows that are there.

        Raises:
            RecordingError: It cannot be written, is damaged, or something else made it.
        """
        self.path, self._head = path, dict(head)
        self.rows: list[dict[str, Any]] = []
        """All that are done, those of the resumed file first."""
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            if path.exists() and resume:
                self._read()
            else:
                if path.exists():
                    path.replace(path.with_suffix(".before.jsonl"))
                path.write_text(json.dumps(self._head) + "\n", encoding="utf-8")
        except OSError as error:
            raise self._not_written(error) from error

    def add(self, *rows: Mapping[str, Any]) -> None:
        """Keep more.

        Raises:
            RecordingError: The disk takes no more.
        """
        try:
            with self.path.open("a", encoding="utf-8") as file:
                file.write("".join(json.dumps(row, ensure_ascii=False) + "\n" for row in rows))
        except OSError as error:
            raise self._not_written(error) from error
        self.rows.extend(map(dict, rows))

    def damaged(self, error: Exception) -> RecordingError:
        """For who cannot understand a row."""
        return RecordingError(f"{self.path} is damaged ({error}). Leave out --resume; it is kept beside.")

    def _not_written(self, error: OSError) -> RecordingError:
        return RecordingError(f"{self.path} cannot be written: {error.strerror}. Give another folder with --out.")

    def _read(self) -> None:
        head, *lines = self.path.read_text(encoding="utf-8", errors="replace").splitlines() or [""]
        try:
            found, whole = json.loads(head), _whole(lines)
            rows = [json.loads(line) for line in whole]
        except json.JSONDecodeError as error:
            raise self.damaged(error) from error
        if found != self._head:
            asked = ", ".join(f"{name} {value}" for name, value in self._head.items() if _differs(found, name, value))
            raise RecordingError(
                f"{self.path} was made by something else ({head}; now {asked}). Leave out --resume, or choose another "
                "--out."
            )
        self.rows = rows
        self.path.write_text("\n".join([head, *whole]) + "\n", encoding="utf-8")


def _differs(found: Any, name: str, value: Any) -> bool:
    return not isinstance(found, dict) or found.get(name) != value


def _whole(lines: Sequence[str]) -> Sequence[str]:
    """Without a last line that was cut off in the middle."""
    try:
        json.loads(lines[-1] if lines else "{}")
    except json.JSONDecodeError:
        return lines[:-1]
    return lines
