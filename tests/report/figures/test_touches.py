"""Accepted touches are drawn on the target and by window; a recording without a task has no such chapter."""

from pathlib import Path

import numpy as np
import pytest
from tests.task.of_run import short_plan
from tests.task.of_run import touch as touched

from exograv.recording import Recording, RecordingWriter, read_recording
from exograv.report.figures import touches
from exograv.report.of_recording.headline import headline
from exograv.report.of_recording.recording_report import page_of
from exograv.report.style.figure_style import house_style
from exograv.report.style.page import page_text
from exograv.task.events import Start, Tick
from exograv.task.record_sinks import recording_sink
from exograv.task.run import TaskRun

SETTINGS = {"rig": "recupera_like", "settings": {"protocol": {"target": {"diameter_mm": 40.0, "diameter_px": 150.0}}}}
PX = [(30.0, 40.0), (-60.0, 80.0), (5.0, 12.0), (8.0, 6.0)]
"""Touches at 50, 100, 13 and 10 px from the target's centre."""


def touch(k: int, is_accepted: bool, pitch: float | None) -> dict:
    x, y = PX[k % len(PX)]
    in_mm = [None, None, None] if pitch is None else [pitch * x, pitch * y, pitch * float(np.hypot(x, y))]
    return {
        "kind": "touch", "t": float(k), "window": 1 + k // 2, "is_accepted": is_accepted,
        "deviation_x_px": x, "deviation_y_px": y, "deviation_px": float(np.hypot(x, y)),
        **dict(zip(("deviation_x_mm", "deviation_y_mm", "deviation_mm"), in_mm, strict=True)),
    }  # fmt: skip


def recorded(path: Path, accepted: list[bool], pitch: float | None = 0.3) -> Recording:
    with RecordingWriter(path, ("shoulder_flexion",), SETTINGS) as recording:
        for k, is_accepted in enumerate(accepted):
            recording.write("/task", float(k), {"kind": "touch", "record": touch(k, is_accepted, pitch)})
        task = {"windows": 2, "touches": len(accepted), "accepted": sum(accepted), "deviation_px": {"median": 31.5}}
        recording.write("/result", 9.0, {"task": task})
    return read_recording(path)


@pytest.mark.parametrize("pitch", [0.3, None])
def test_every_touch_that_counts_is_on_the_target(tmp_path: Path, pitch: float | None):
    recording = recorded(tmp_path / "a.mcap", [True, False, True, True], pitch)
    assert len(touches.counted(recording)) == 3
    with house_style():
        figure = touches.draw(recording)
    assert figure is not None
    target, by_window = figure.axes
    drawn = np.asarray(target.collections[0].get_offsets())
    unit = pitch or 1.0
    np.testing.assert_allclose(drawn, unit * np.array([(PX[k][0], -PX[k][1]) for k in (0, 2, 3)]))
    assert len(by_window.lines) == 3  # two windows and their median
    assert "1 touches were rejected" in touches.explain(recording)


def test_the_page_begins_with_what_was_touched(tmp_path: Path):
    recording = recorded(tmp_path / "a.mcap", [True] * 4)
    assert headline(recording) == "2 windows, 4 accepted touches: half of them within 32 px of the target's centre."
    assert '<section id="touches">' in page_text(page_of(recording))


@pytest.mark.parametrize("is_whole", [True, False])
def test_a_session_at_a_page_is_complete_if_its_run_has_come_to_its_end(tmp_path: Path, is_whole: bool):
    with RecordingWriter(tmp_path / "a.mcap", ("shoulder_flexion",), SETTINGS) as recording:
        run = TaskRun(short_plan(windows=1), sinks=(recording_sink(recording),))
        for event in (Start(t=0.0), touched(38.0, 0), touched(41.0, 1), Tick(t=1000.0 if is_whole else 50.0)):
            run.feed(event)
    said = headline(read_recording(tmp_path / "a.mcap"))
    if is_whole:
        assert said == "1 windows, 2 accepted touches: half of them within 5 px of the target's centre."
    else:
        assert "was not completed" in said


def test_without_a_touch_that_counts_there_is_no_such_chapter(tmp_path: Path):
    assert touches.draw(recorded(tmp_path / "a.mcap", [])) is None
    assert touches.draw(recorded(tmp_path / "b.mcap", [False])) is None
