"""What the pages did, as lines of JSON on the disk and in the recording of the machine."""

import json
import os
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from exograv.errors import RecordingError

from .sentences import say

Write = Callable[[str, float, Mapping[str, Any]], None]


class EventLog:
    """A line at once for everything that happens: the machine's recording runs only while the machine does."""

    def __init__(self, path: Path, also: Write):
        """Open the file.

        Args:
            path: Of the file; it is never overwritten.
            also: `Desk.write`.

        Raises:
            RecordingError: It cannot be written.
        """
        self.path, self._also = path, also
        self.why = ""
        """What was wrong with the last line; empty where nothing was."""

        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            # Without a buffer: what a full disk refused is not tried again at the end.
            self._file = path.open("xb", buffering=0)
        except OSError as error:
            raise RecordingError(f"{path} cannot be written: {error.strerror}. Give another --out.") from error

    def write(self, topic: str, t: float, message: Mapping[str, Any]) -> None:
        """Keep it; a disk that is full is an alarm, and no reason to stop."""
        self._also(topic, t, message)
        line = json.dumps({"topic": topic, "t": t, "message": dict(message)}, ensure_ascii=False)
        try:
            self._file.write(line.encode() + b"\n")
        except OSError as error:
            self.why = say("alarm.diary", path=self.path, why=error.strerror)
        else:
            self.why = ""

    def close(self) -> None:
        """To the disk, and done."""
        try:
            os.fsync(self._file.fileno())
        except OSError as error:
            self.why = say("alarm.diary", path=self.path, why=error.strerror)
        finally:
            self._file.close()
