"""Parts of one session: its recordings, and the diaries of the commands that made them."""

import json
import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from exograv.errors import RecordingError
from exograv.recording.contents import Contents, messages_in
from exograv.recording.file_content import read_content
from exograv.recording.reader import settings_of
from exograv.recording.schema import SETTINGS
from exograv.task.record_sinks import TASK_TOPIC
from exograv.task.run_statement import STATEMENT_TOPIC, RunStatement

DIARIES = "console-*.jsonl"
LINE_MAX_BYTES = 1_000_000


@dataclass(frozen=True)
class SessionParts:
    """Files of one session, in order."""

    recordings: tuple[Path, ...]
    """Recordings: one for each time that the motors were on."""

    diaries: tuple[Path, ...] = ()
    """Diaries: one for each command. They hold also the records that came while the motors were off."""


@dataclass(frozen=True)
class DiaryLine:
    """Line of a diary: a record of the task, or a statement."""

    t: float
    """CLOCK_MONOTONIC of the line [s]."""

    content: dict[str, Any] | RunStatement


def session_of(path: Path) -> SessionParts:
    """Return all parts of the session of a recording. The others are in the same folder.

    Raises:
        RecordingError: The file is not a recording of exograv.
    """
    statement = statement_of(path)
    return SessionParts((path,)) if statement is None else parts_in(path.parent, statement.run)


def parts_in(folder: Path, run: str) -> SessionParts:
    """Return the parts of a run in a folder."""
    recordings = [path for path in folder.glob("*.mcap") if _run_of(path) == run]
    return SessionParts(tuple(sorted(recordings, key=_number)), tuple(_diaries_of(folder, run)))


def statement_of(path: Path) -> RunStatement | None:
    """Return the statement of a recording about its run; None without one. Only the settings are read.

    Raises:
        RecordingError: The file is not a recording of exograv.
    """
    with read_content(path) as content:
        for topic, data in messages_in(content, Contents()):
            if topic == SETTINGS.topic:
                return _statement((settings_of(path, [data]).get("settings") or {}).get("run"))
    return None


def diary_lines(path: Path) -> Iterator[DiaryLine]:
    """Yield the records of the task and the statements in a diary. A line that was cut by a kill is left out."""
    with path.open("rb") as file:
        while line := file.readline(LINE_MAX_BYTES):
            try:
                told = json.loads(line)
                topic, t, message = told["topic"], float(told["t"]), dict(told["message"])
            except (ValueError, KeyError, TypeError):
                continue
            if topic == TASK_TOPIC:
                yield DiaryLine(t, message)
            elif topic == STATEMENT_TOPIC and (statement := _statement(message)) is not None:
                yield DiaryLine(t, statement)


def _diaries_of(folder: Path, run: str) -> Iterator[Path]:
    for path in sorted(folder.glob(DIARIES)):  # the name has the time of the command's start
        statements = (line.content for line in diary_lines(path) if isinstance(line.content, RunStatement))
        if any(statement.run == run for statement in statements):
            yield path


def _run_of(path: Path) -> str | None:
    try:
        statement = statement_of(path)
    except RecordingError:
        return None  # a command that ended at once leaves a file without settings
    return None if statement is None else statement.run


def _statement(content: Any) -> RunStatement | None:
    try:
        return RunStatement.model_validate(content)
    except ValidationError:
        return None


def _number(path: Path) -> tuple[int, str]:
    """Order of recordings: the number at the end of the name."""
    found = re.search(r"(\d+)$", path.stem)
    return (int(found[1]) if found else 0, path.name)
