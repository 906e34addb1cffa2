"""Records of a run from several commands, in order: each touch once, attempts apart, no window complete twice.

A command that is killed may leave records that are later than its last checkpoint. The next command resumes from the
checkpoint: it may open an attempt of the same number again, or repeat a window that the records show as complete.
"""

from typing import Any

from exograv.study.importers.task_records import SENT_AGAIN
from exograv.task.run_statement import RunStatement

Record = dict[str, Any]
Attempt = tuple[int, int]


class JoinedRecords:
    """Takes statements and records in their order, and corrects the records."""

    def __init__(self) -> None:
        self.missing = set[int]()
        """Windows that were complete by a statement, without a record of their end."""
        self._opened = set[Attempt]()
        self._closed = dict[Attempt, Record]()
        self._later = dict[int, int]()  # by window: difference of the numbers of attempts since the last kill
        self._touches = set[tuple[str, int]]()

    def begin(self, statement: RunStatement) -> None:
        """Begin a command, or a process of the pages that replaced another. It knows only what its checkpoint holds."""
        for (window, _), record in self._closed.items():
            if record["is_complete"] and window not in statement.complete:
                record |= {"is_complete": False, "by": "interruption"}
        self.missing |= set(statement.complete) - self.complete

    @property
    def complete(self) -> set[int]:
        """Numbers of the windows that are complete."""
        return {window for (window, _), record in self._closed.items() if record["is_complete"]}

    def take(self, record: Record) -> Record | None:
        """Return the record as it belongs to the whole run; None for one that the run has already.

        The end of a window that is not complete is changed later, if it turns out that the run repeats this window.
        """
        record = dict(record)
        if record["kind"] == "window_opened":
            self._open(record)
        elif record.get("attempt") is not None:
            record["attempt"] += self._later.get(record["window"], 0)
        if record["kind"] == "touch":
            return record if self._is_new(record) else None
        if record["kind"] == "window_closed":
            attempt = record["window"], record["attempt"]
            return record if self._closed.setdefault(attempt, record) is record else None
        return record

    def _open(self, record: Record) -> None:
        window, attempt = record["window"], record["attempt"] + self._later.get(record["window"], 0)
        if (window, attempt) in self._opened:
            last = max(number for of, number in self._opened if of == window)
            self._later[window] = last + 1 - record["attempt"]
            attempt = last + 1
        self._opened.add((window, attempt))
        record["attempt"] = attempt

    def _is_new(self, touch: Record) -> bool:
        key = touch["page"], touch["sequence"]
        if key in self._touches and touch["reason"] != SENT_AGAIN:
            return False
        self._touches.add(key)
        return True
