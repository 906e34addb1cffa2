"""Every sink of a run receives the same records: recording, marker stream and checkpoint."""

import json
from collections.abc import Mapping
from typing import Any

from exograv.task.events import Start, Tick
from exograv.task.record_sinks import CHECKPOINT_EVERY_S, checkpoint_sink, marker_sink, recording_sink
from exograv.task.records import RECORD
from exograv.task.run import TaskRun

from .of_run import short_plan, touch


class Written(list[tuple[str, float, Mapping[str, Any]]]):
    """Writer that stores its messages."""

    def write(self, topic: str, t: float, message: Mapping[str, Any], /) -> None:
        self.append((topic, t, message))


def test_recording_and_markers_hold_the_same_json_of_every_record():
    written, markers = Written(), list[list[str]]()
    run = TaskRun(short_plan(), sinks=(recording_sink(written), marker_sink(markers.append)))
    records = [*run.feed(Start(t=0.0)), *run.feed(Tick(t=40.0)), *run.feed(touch(41.0, 0))]
    assert {record.kind for record in records} >= {"run_began", "window_opened", "touch"}
    assert [RECORD.validate_json(text) for (text,) in markers] == records
    for (topic, t, message), (text,), record in zip(written, markers, records, strict=True):
        assert (topic, t, message["kind"]) == ("/task", record.t, record.kind)
        assert message["record"] == json.loads(text)


def test_a_checkpoint_follows_every_record_and_silence_is_never_longer_than_its_period():
    times = list[float]()
    run = TaskRun(short_plan(), sinks=(checkpoint_sink(times.append),))
    run.feed(Tick(t=0.0))
    run.feed(Tick(t=1.0))
    assert times == [0.0]
    run.feed(Tick(t=1.0 + CHECKPOINT_EVERY_S))
    run.feed(Start(t=12.0))
    assert times == [0.0, 11.0, 12.0]
