"""The diary has a line for every event; a full disk raises an alarm and stops nothing."""

import json
from pathlib import Path

import pytest

from exograv.console.alarms import KEPT_MAX, Alarms
from exograv.console.event_log import EventLog
from exograv.console.messages import Ping, Pinged
from exograv.console.page_clocks import PAGES_MAX, PageClocks
from exograv.errors import RecordingError


def test_a_line_is_on_the_disk_at_once_and_goes_to_the_recording_too(tmp_path: Path):
    also = list[object]()
    diary = EventLog(tmp_path / "new" / "d.jsonl", lambda *told: also.append(told))
    diary.write("/task", 1.5, {"text": "Ä"})
    assert json.loads(diary.path.read_text(encoding="utf-8")) == {"topic": "/task", "t": 1.5, "message": {"text": "Ä"}}
    assert also == [("/task", 1.5, {"text": "Ä"})]
    diary.close()


def test_a_diary_is_never_written_over(tmp_path: Path):
    EventLog(tmp_path / "d.jsonl", lambda *_: None).close()
    with pytest.raises(RecordingError, match="--out"):
        EventLog(tmp_path / "d.jsonl", lambda *_: None)


def test_a_full_disk_is_said_and_raises_nothing(tmp_path: Path):
    diary = EventLog(tmp_path / "d.jsonl", lambda *_: None)
    diary._file.close()
    diary._file = Path("/dev/full").open("wb", buffering=0)  # noqa: SIM115 - the diary closes the file
    diary.write("/task", 0.0, {})
    assert "No space left" in diary.why
    diary.close()


def test_an_event_that_a_full_disk_refused_is_written_once_there_is_room(tmp_path: Path):
    diary = EventLog(tmp_path / "d.jsonl", lambda *_: None)
    file = diary._file
    with Path("/dev/full").open("wb", buffering=0) as full:
        diary._file = full
        diary.write("/task", 0.0, {"number": 1})
        with pytest.raises(RecordingError, match="No space left"):
            diary.sync()
    diary._file = file
    diary.write("/task", 1.0, {"number": 2})
    diary.sync()
    lines = diary.path.read_text(encoding="utf-8").splitlines()
    assert [json.loads(line)["message"]["number"] for line in lines] == [1, 2]
    assert not diary.why
    diary.close()


def test_the_same_alarm_again_is_counted_and_many_do_not_fill_the_memory():
    alarms = Alarms()
    first = alarms.sound("once", 0.0)
    assert alarms.sound("once", 1.0).number == first.number
    assert alarms.open[0].times == 2
    for number in range(3 * KEPT_MAX):
        alarms.sound(str(number), 2.0)
    assert len(alarms.open) == KEPT_MAX


def test_clocks_of_pages_that_were_closed_are_forgotten_one_day():
    clocks = PageClocks()
    for number in range(3 * PAGES_MAX):
        clocks.ping(f"page-{number}", Ping(asked=1.0), 10.0, 10.0)
        clocks.ping(f"page-{number}", Ping(asked=2.0, previous=Pinged(asked=1.0, back=1.01)), 11.0, 11.0)
    assert clocks.place("page-0", 1.0) is None
    placed = clocks.place(f"page-{3 * PAGES_MAX - 1}", 2.0)
    assert placed is not None
    assert abs(placed.t - 11.0) < 0.02
    assert len(clocks._pages) == PAGES_MAX
