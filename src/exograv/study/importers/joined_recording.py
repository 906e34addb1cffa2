"""Join of all recordings and diaries of an interrupted session into one recording.

The recordings follow each other on one clock, with the true pauses between them. All messages are kept. Records of the
task come from the diaries too: a diary holds a record before its touch is acknowledged, also while the motors are off.
"""

import contextlib
import itertools
import json
import math
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from exograv.files import PARTIAL
from exograv.recording import RecordingPass, RecordingWriter
from exograv.recording.contents import Contents, messages_in
from exograv.recording.encoding import unpacked_ticks
from exograv.recording.file_content import foreign_messages_refused, read_content
from exograv.recording.message_check import read_message
from exograv.recording.schema import CHANNELS, SETTINGS, TICK
from exograv.recording.stream_block import StreamFormat, value_type_of, with_connection
from exograv.task.record_sinks import TASK_TOPIC
from exograv.task.run_statement import RunStatement

from .joined_records import JoinedRecords, Record
from .recording import JOINED_EVENT
from .session_parts import DiaryLine, SessionParts, diary_lines, statement_of

AWAY_S = 300.0
"""Pause between two recordings if the computer was started again between them, so that its length is unknown [s]."""

INSTANT_S = 1e-3
WITH_CONNECTION = frozenset({"/stream", "/correction"})


@dataclass
class Part:
    """Recording of a session, with its place on the clock of the whole."""

    path: Path
    settings: Mapping[str, Any]
    statement: RunStatement | None
    tasks: Sequence[Mapping[str, Any]]
    """Messages of the task."""

    first: tuple[float, float]
    """First tick: time on the rig's clock and CLOCK_MONOTONIC [s]; NaN without ticks."""

    last: tuple[float, float]
    remark: str | None
    streams: tuple[StreamFormat, ...]
    later_s: float = 0.0
    """Time to add to the times of the recording [s]."""

    after_s: float = -math.inf
    """End of the recording before, on the clock of the whole [s]."""

    records: list[tuple[float, Record]] = field(default_factory=list)
    """Records of the task with their times on the clock of the whole [s]."""

    def time_of(self, monotonic: float) -> float:
        """Return a time of CLOCK_MONOTONIC on the clock of the whole [s], after the recording before."""
        told = self.first[0] + self.later_s + monotonic - self.first[1]
        return max(told if math.isfinite(told) else self.later_s, self.after_s + INSTANT_S, 0.0)


@contextlib.contextmanager
def whole_recording(session: SessionParts, folder: Path, name: str) -> Iterator[Path]:
    """Yield the path of the recording of a whole session: its only recording, or a file that joins all parts.

    Args:
        session: Parts of the session.
        folder: Folder for the file that joins them, which is removed at the end.
        name: Name of this file, without suffix.

    Raises:
        RecordingError: A part cannot be read, or the disk is full.
    """
    is_alone = len(session.recordings) == 1
    if is_alone and not session.diaries:
        yield session.recordings[0]
        return
    parts, missing = _placed(session)
    if is_alone and [record for _, record in parts[0].records] == [one["record"] for one in parts[0].tasks]:
        yield parts[0].path
        return
    with tempfile.TemporaryDirectory(prefix=PARTIAL, dir=folder) as place:
        path = Path(place) / f"{name}.mcap"
        _write(parts, missing, path)
        yield path


def _placed(session: SessionParts) -> tuple[list[Part], set[int]]:
    """Return the parts with their places and records, and the windows of parts that are missing."""
    parts = [_read(path) for path in session.recordings]
    diaries = [list(diary_lines(path)) for path in session.diaries]
    for before, part in itertools.pairwise(parts):
        part.after_s = (before.last[0] if math.isfinite(before.last[0]) else 0.0) + before.later_s
        pause = part.first[1] - before.last[1]
        pause = pause if math.isfinite(pause) and pause > 0.0 else AWAY_S
        part.later_s = part.after_s + pause - (part.first[0] if math.isfinite(part.first[0]) else 0.0)
    joined = JoinedRecords()
    for of, lines, with_own in _launches(parts, diaries):
        _fill(of, lines, joined, with_own)
    return parts, joined.missing


def _read(path: Path) -> Part:
    passing = RecordingPass(path, (TASK_TOPIC,))
    first = last = (math.nan, math.nan)
    for ticks in passing.ticks():
        if len(ticks):
            first = first if math.isfinite(first[0]) else _times(ticks[0])
            last = _times(ticks[-1])
    recording = passing.recording()
    return Part(path, recording.settings, statement_of(path), recording.messages(TASK_TOPIC), first, last,
                recording.remark, _streams(path))  # fmt: skip


def _times(tick: np.void) -> tuple[float, float]:
    return float(tick["t"]), float(tick["monotonic"])


def _streams(path: Path) -> tuple[StreamFormat, ...]:
    found = Contents()
    with read_content(path) as content:
        next(messages_in(content, found), None)
    kinds = {schema.id: schema.name for schema in found.schemas}
    others = [channel for channel in found.channels if channel.topic.startswith("/lsl/")]
    return tuple(StreamFormat(channel.topic, value_type_of(kinds[channel.schema_id])) for channel in others)


def _launches(
    parts: Sequence[Part], diaries: Sequence[list[DiaryLine]]
) -> Iterator[tuple[list[Part], list[DiaryLine], bool]]:
    """Yield recordings and diary of each command, in order, and True if the recordings are its own."""
    by_launch = dict[str, tuple[list[Part], list[DiaryLine]]]()
    for lines in diaries:
        statement = next(line.content for line in lines if isinstance(line.content, RunStatement))
        by_launch[statement.launch] = ([], lines)
    for part in parts:
        launch = str(part.path) if part.statement is None else part.statement.launch
        by_launch.setdefault(launch, ([], []))[0].append(part)
    kept = list(by_launch.values())
    # A command that ended with its motors off has a diary only: its records belong to the recording before or after.
    places = {id(part): number for number, part in enumerate(parts)}
    for number, (of, lines) in enumerate(kept):
        if of:
            yield of, lines, True
            continue
        near = next((one for one, _ in (*reversed(kept[:number]), *kept[number + 1 :]) if one), None)
        if near is not None:
            yield [max(near, key=lambda part: places[id(part)])], lines, False


def _fill(parts: Sequence[Part], lines: Sequence[DiaryLine], joined: JoinedRecords, with_own: bool) -> None:
    """Give records of a command to recordings: those of its diary, and with `with_own` the recordings' further ones."""
    own = {_key(task["record"]): (number, task["t"]) for number, part in enumerate(parts) for task in part.tasks}
    told = {_key(line.content) for line in lines if isinstance(line.content, dict)}
    if not any(isinstance(line.content, RunStatement) for line in lines) and parts[0].statement is not None:
        joined.begin(parts[0].statement)
    present = 0
    for line in lines:
        if isinstance(line.content, RunStatement):
            joined.begin(line.content)
            continue
        present, t = own.get(_key(line.content), (present, None))
        part = parts[present]
        _take(part, part.time_of(line.t) if t is None else t + part.later_s, line.content, joined)
    for part in parts:
        for task in part.tasks if with_own else ():
            if (key := _key(task["record"])) not in told:
                told.add(key)
                _take(part, task["t"] + part.later_s, task["record"], joined)


def _take(part: Part, t: float, record: Mapping[str, Any], joined: JoinedRecords) -> None:
    taken = joined.take(dict(record))
    if taken is not None:
        part.records.append((t, taken))


def _key(record: Mapping[str, Any]) -> str:
    return json.dumps(record, sort_keys=True)


def _write(parts: Sequence[Part], missing: set[int], path: Path) -> None:
    begun = next((part for part in parts if any(task["kind"] == "run_began" for task in part.tasks)), parts[0])
    remarks = [part.remark for part in parts if part.remark]
    if missing:
        remarks.append(
            f"Windows that were complete in a recording that is missing: {', '.join(map(str, sorted(missing)))}."
        )
    head = {name: value for name, value in begun.settings.items() if name not in ("schema_version", "joints")}
    joined = {"recordings": len(parts), "remarks": remarks}
    head["settings"] = {**(head.get("settings") or {}), "joined": joined}
    streams = {one.topic: one for part in parts for one in part.streams}
    with RecordingWriter(path, begun.settings["joints"], head, tuple(streams.values())) as writer:
        connections = 0
        for number, part in enumerate(parts, start=1):
            if number > 1:
                text = f"Recording {number} of {len(parts)} begins."
                writer.write("/event", part.after_s + 0.5 * INSTANT_S, {"kind": JOINED_EVENT, "text": text})
            for t, record in part.records:
                writer.write(TASK_TOPIC, t, {"kind": record["kind"], "record": record})
            connections = _copy(part, writer, connections)


def _copy(part: Part, writer: RecordingWriter, connections: int) -> int:
    """Copy ticks and messages of a recording, except its task; return the number of connections to devices so far."""
    n_joints, version = len(part.settings["joints"]), part.settings["schema_version"]
    phases, last = writer.count("/phase"), connections
    with read_content(part.path) as content, foreign_messages_refused(part.path):
        for topic, data in messages_in(content, Contents()):
            if topic == TICK.topic:
                ticks = unpacked_ticks(data, n_joints, version).copy()
                ticks["t"] += part.later_s
                ticks["now"] += part.later_s
                ticks["phase"] += phases
                writer.ticks(ticks)
            elif topic not in CHANNELS:
                block, number, received = with_connection(data, connections)
                last = max(last, number)
                writer.write_block(topic, max(part.time_of(received), 0.0), block)
            elif topic not in (TASK_TOPIC, SETTINGS.topic):
                message = dict(read_message(part.path, CHANNELS[topic], data, part.settings))
                t = message.get("t", 0.0) + part.later_s
                if "t" in message:
                    message["t"] = t
                if topic in WITH_CONNECTION:
                    message["connection"] += connections
                    last = max(last, message["connection"])
                writer.write(topic, t, message)
    return last
