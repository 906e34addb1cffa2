"""Diary of the console: events of the pages as lines of JSON on disk, and in the recording of the machine."""

import contextlib
import json
import os
import threading
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from exograv.errors import RecordingError

from .sentences import say

Write = Callable[[str, float, Mapping[str, Any]], None]


class EventLog:
    """Diary of all events, written at once, because the machine's recording exists only while the machine runs."""

    def __init__(self, path: Path, also: Write, continues: bool = False):
        """Open the file.

        Args:
            path: File of the diary; an existing file is never overwritten.
            also: Second writer of each event: `Desk.write`.
            continues: True to append to the file of a process that has ended.

        Raises:
            RecordingError: The file cannot be written.
        """
        self.path, self._also = path, also
        self._one_at_a_time = threading.Lock()
        self._waiting = bytearray()  # lines, or the rest of a line, that a full disk has refused
        self.why = ""
        """Error of the last write; empty without an error."""

        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            # Without a buffer: a line is with the operating system before its touch is acknowledged.
            self._file = path.open("ab" if continues else "xb", buffering=0)
        except OSError as error:
            raise RecordingError(f"{path} cannot be written: {error.strerror}. Give another --out.") from error

    def write(self, topic: str, t: float, message: Mapping[str, Any]) -> None:
        """Write an event. A full disk raises an alarm, but does not stop the console; the event is written later."""
        self._also(topic, t, message)
        line = json.dumps({"topic": topic, "t": t, "message": dict(message)}, ensure_ascii=False)
        with self._one_at_a_time:
            self._waiting += line.encode() + b"\n"
            self._write_waiting()

    def sync(self) -> None:
        """Force all events to the disk. A checkpoint may state only what the diary holds.

        Raises:
            RecordingError: The disk is full or failing.
        """
        with self._one_at_a_time:
            self._write_waiting()
            if not self._waiting:
                try:
                    os.fsync(self._file.fileno())
                except OSError as error:
                    self._failed(error)
            if self.why:
                raise RecordingError(self.why)

    def close(self) -> None:
        """Force the diary to the disk and close it."""
        with contextlib.suppress(RecordingError):
            self.sync()
        self._file.close()

    def _write_waiting(self) -> None:
        try:
            while self._waiting:
                del self._waiting[: self._file.write(bytes(self._waiting))]
        except OSError as error:
            self._failed(error)
        else:
            self.why = ""

    def _failed(self, error: OSError) -> None:
        self.why = say("alarm.diary", path=self.path, why=error.strerror)
