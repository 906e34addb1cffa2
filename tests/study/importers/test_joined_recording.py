"""A session that was interrupted is one session in the study: touches once, attempts apart, windows counted once."""

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from tests.study.made_up_sessions import BEGUN_S, JOINTS, ZEROS, settings, touch

from exograv.recording import Recording, RecordingWriter, read_recording
from exograv.recording.stream_block import StreamBlock, StreamFormat, packed
from exograv.study.importers.imported_session import Imported
from exograv.study.importers.joined_recording import AWAY_S, whole_recording
from exograv.study.importers.recording import import_recording
from exograv.study.importers.session_parts import session_of
from exograv.task.run_statement import STATEMENT_TOPIC, RunStatement

CODE = "K9RR9PR"
AHEAD_S = 5000.0
"""Difference of CLOCK_MONOTONIC to the rig's clock of the first recording [s]."""

STATEMENT = RunStatement(
    run="r1", launch="a", participant=CODE, protocol="training", protocol_sha256="ab" * 32, session=1
)
DEVICE = StreamFormat("/lsl/belt", "float32")


def record(kind: str, t: float, window: int, attempt: int = 1, **more: Any) -> dict[str, Any]:
    said = {"kind": kind, "t": t, "window": window, "attempt": attempt}
    if kind == "window_opened":
        return {**said, "by": "clock", "gravity_level": 0.0, **more}
    return {**said, "by": "clock", "is_complete": True, "marks": [], **more}


def began(t: float) -> dict[str, Any]:
    return {"kind": "run_began", "t": t, "protocol": "training", "protocol_sha256": "ab" * 32, "pitch_mm": [0.3, 0.3],
            "windows": 2, "participant": CODE, "session": 1}  # fmt: skip


def stated(**changes: Any) -> RunStatement:
    return STATEMENT.model_copy(update=changes)


def part(
    path: Path, statement: RunStatement, records: Sequence[Mapping[str, Any]], monotonic_s: float, seconds: float = 20.0
) -> Path:
    """Write a recording whose rig's clock begins at `BEGUN_S`; times of records are those of CLOCK_MONOTONIC."""
    said = settings(CODE)
    said["settings"] = {"run": statement.model_dump(mode="json")}
    with RecordingWriter(path, JOINTS, said, [DEVICE]) as recording:
        recording.phase(BEGUN_S, "live")
        for k, t in enumerate(BEGUN_S + np.arange(0.0, seconds, 0.1)):
            clocks = {"now": float(t), "monotonic": float(t) - BEGUN_S + monotonic_s}
            recording.tick(float(t), closure_slope=0.0, tick_us=1.0, sequence=k + 1, **clocks, **ZEROS)
        block = StreamBlock(monotonic_s + 1.0, 1, np.array([7.0]), np.ones((1, 2), np.float32))
        recording.write_block(DEVICE.topic, BEGUN_S + 1.0, packed(block, 2))
        for one in records:
            t = BEGUN_S + one["t"] - monotonic_s
            recording.write("/task", t, {"kind": one["kind"], "record": one})
    return path


def diary(path: Path, *lines: Mapping[str, Any] | RunStatement) -> Path:
    """Write the diary of a command."""
    with path.open("w", encoding="utf-8") as file:
        for line in lines:
            is_statement = isinstance(line, RunStatement)
            message = line.model_dump(mode="json") if isinstance(line, RunStatement) else dict(line)
            topic, t = (STATEMENT_TOPIC, 0.0) if is_statement else ("/task", message["t"])
            file.write(json.dumps({"topic": topic, "t": t, "message": message}) + "\n")
        file.write('{"topic": "/task", "t": 1')  # cut by a kill
    return path


def joined(path: Path) -> tuple[Recording, Imported]:
    with whole_recording(session_of(path), path.parent, "whole") as whole:
        return read_recording(whole), import_recording(whole)


A, B = AHEAD_S, AHEAD_S + 60.0
FIRST = (
    began(A + 1.0),
    record("window_opened", A + 2.0, 1), touch(A + 3.0, 1, 1), record("window_closed", A + 6.0, 1),
    record("window_opened", A + 12.0, 2), touch(A + 13.0, 2, 2),
)  # fmt: skip
LATE = touch(A + 14.0, 3, 2)
"""Touch that is in the diary only."""

SECOND = (
    record("window_closed", A + 14.5, 2, by="interruption", is_complete=False),
    {"kind": "paused", "t": B - 5.0, "why": "the program was interrupted"},
    record("window_opened", B + 2.0, 2, 2), touch(B + 3.0, 1, 2, attempt=2, page="page2"),
    record("window_closed", B + 6.0, 2, 2),
    {"kind": "run_ended", "t": B + 9.0, "is_complete": True, "why": ""},
)  # fmt: skip


def interrupted(folder: Path) -> Path:
    """Write a session of two commands; return its first recording."""
    resumed = stated(launch="b", complete=(1,))
    first = part(folder / "steered-1.mcap", STATEMENT, FIRST, A)
    part(folder / "steered-2.mcap", resumed, SECOND[2:], B)
    diary(folder / "console-1.jsonl", STATEMENT, *FIRST, LATE)
    diary(folder / "console-2.jsonl", resumed, *SECOND)
    part(folder / "steered-3.mcap", stated(run="other"), FIRST, A)
    return first


def test_one_recording_stands_for_all_of_its_session_and_for_no_other(tmp_path: Path):
    first = interrupted(tmp_path)
    parts = session_of(first)
    assert [path.name for path in parts.recordings] == ["steered-1.mcap", "steered-2.mcap"]
    assert session_of(tmp_path / "steered-2.mcap") == parts
    assert [path.name for path in parts.diaries] == ["console-1.jsonl", "console-2.jsonl"]


def test_windows_and_touches_of_all_recordings_are_those_of_one_session(tmp_path: Path):
    _, found = joined(interrupted(tmp_path))
    windows = [(row["window"], row["attempt"], row["is_complete"], row["touches"]) for row in found.windows]
    assert windows == [(1, 1, True, 1), (2, 1, False, 2), (2, 2, True, 1)]
    assert (found.session["windows_complete"], found.session["touches"], found.session["is_complete"]) == (2, 4, True)
    assert (found.said.participant, found.said.protocol, found.said.session) == (CODE, "training", 1)
    assert found.session["clock_jumps"] == 0
    assert found.session["ticks"] == 400
    assert "Joined from 2 recordings." in found.session["remark"]


def test_a_touch_that_only_the_diary_holds_has_its_time_on_the_clock_of_the_recording(tmp_path: Path):
    _, found = joined(interrupted(tmp_path))
    times = {(row["page"], row["sequence"]): row["t_s"] for row in found.touches}
    assert times["page1", 3] == pytest.approx(14.0)
    assert times["page2", 1] == pytest.approx(63.0)  # the pause between the recordings keeps its length


def test_messages_of_a_later_recording_follow_with_their_phase_and_connection(tmp_path: Path):
    whole, _ = joined(interrupted(tmp_path))
    assert len(whole.messages("/phase")) == 2
    assert np.unique(whole.ticks["phase"]).tolist() == [1, 2]
    (stream,) = whole.streams
    assert stream.connection.tolist() == [1, 2]
    assert (np.diff(whole.ticks["t"]) > 0.0).all()


def test_a_computer_that_was_started_again_leaves_a_pause_of_unknown_length(tmp_path: Path):
    part(tmp_path / "steered-1.mcap", STATEMENT, FIRST, A)
    part(tmp_path / "steered-2.mcap", stated(launch="b", complete=(1,)), SECOND[2:4], 30.0)
    whole, _ = joined(tmp_path / "steered-1.mcap")
    assert np.diff(whole.ticks["t"]).max() == pytest.approx(AWAY_S)


def test_an_attempt_that_the_checkpoint_does_not_know_keeps_apart_from_the_next_of_its_number(tmp_path: Path):
    closes = record("window_closed", A + 16.0, 2)
    again = (
        record("window_opened", B + 2.0, 2),
        touch(B + 3.0, 1, 2, page="page2"),
        record("window_closed", B + 6.0, 2),
    )
    resumed = stated(launch="b", complete=(1,))
    first = part(tmp_path / "steered-1.mcap", STATEMENT, (*FIRST, closes), A)
    part(tmp_path / "steered-2.mcap", resumed, again, B)
    diary(tmp_path / "console-1.jsonl", STATEMENT, *FIRST, closes)
    diary(tmp_path / "console-2.jsonl", resumed, *again)
    _, found = joined(first)
    windows = [(row["window"], row["attempt"], row["is_complete"], row["touches"]) for row in found.windows]
    assert windows == [(1, 1, True, 1), (2, 1, False, 1), (2, 2, True, 1)]


def test_a_window_whose_end_the_checkpoint_does_not_know_is_not_counted_twice(tmp_path: Path):
    closes = record("window_closed", A + 16.0, 2)
    resumed = stated(launch="b", complete=(1,))
    first = part(tmp_path / "steered-1.mcap", STATEMENT, (*FIRST, closes), A)
    part(tmp_path / "steered-2.mcap", resumed, SECOND[2:], B)
    diary(tmp_path / "console-1.jsonl", STATEMENT, *FIRST, closes)
    diary(tmp_path / "console-2.jsonl", resumed, *SECOND)
    _, found = joined(first)
    assert [(row["window"], row["attempt"], row["is_complete"]) for row in found.windows] == [
        (1, 1, True), (2, 1, False), (2, 2, True)]  # fmt: skip
    assert [row["closed_s"] for row in found.windows] == pytest.approx([6.0, 16.0, 66.0])


def test_a_touch_that_the_page_sent_again_to_the_next_server_is_there_once(tmp_path: Path):
    again = (stated(complete=(1,)), touch(A + 13.0, 2, 2), record("window_closed", A + 16.0, 2))
    first = part(tmp_path / "steered-1.mcap", STATEMENT, (*FIRST, *again[1:]), A)
    diary(tmp_path / "console-1.jsonl", STATEMENT, *FIRST, *again)
    _, found = joined(first)
    assert [row["touches"] for row in found.windows] == [1, 1]


def test_a_command_without_a_recording_adds_only_the_records_of_its_diary(tmp_path: Path):
    ends = ({"kind": "paused", "t": B, "why": "the program was interrupted"}, SECOND[-1])
    closes = record("window_closed", A + 16.0, 2)
    first = part(tmp_path / "steered-1.mcap", STATEMENT, (*FIRST, closes), A)
    diary(tmp_path / "console-1.jsonl", STATEMENT, *FIRST, closes)
    diary(tmp_path / "console-2.jsonl", stated(launch="b", complete=(1, 2)), *ends)
    whole, found = joined(first)
    assert [(row["window"], row["attempt"], row["is_complete"]) for row in found.windows] == [
        (1, 1, True), (2, 1, True)]  # fmt: skip
    assert len(whole.messages("/task")) == len(FIRST) + 3
    assert found.session["is_complete"]


def test_a_recording_that_is_missing_is_named_by_the_windows_in_it(tmp_path: Path):
    first = interrupted(tmp_path)
    later = first.with_name("steered-2.mcap")
    first.unlink()
    (tmp_path / "console-1.jsonl").unlink()
    _, found = joined(later)
    assert "Windows that were complete in a recording that is missing: 1." in found.session["remark"]


def test_a_whole_recording_is_taken_as_it_is(tmp_path: Path):
    path = part(tmp_path / "steered-1.mcap", STATEMENT, FIRST, A)
    diary(tmp_path / "console-1.jsonl", STATEMENT, *FIRST)
    with whole_recording(session_of(path), tmp_path, "whole") as whole:
        assert whole == path
    assert sorted(one.name for one in tmp_path.iterdir()) == ["console-1.jsonl", "steered-1.mcap"]
