"""The figure of the tick's duration compares with the period that the recording states."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from exograv.recording import RecordingWriter, read_recording
from exograv.report.figures.timing import USUAL_US, period_us


@pytest.mark.parametrize(
    ("settings", "expected_us"),
    [({}, USUAL_US), ({"settings": {}}, USUAL_US), ({"settings": {"live": {"period_s": 0.004}}}, 4000.0)],
)
def test_the_period_is_that_of_the_live_run_or_else_the_usual_one(
    tmp_path: Path, settings: dict[str, Any], expected_us: float
):
    with RecordingWriter(tmp_path / "a.mcap", ("elbow_flexion",), {}):
        pass
    recording = replace(read_recording(tmp_path / "a.mcap"), settings=settings)
    assert period_us(recording) == pytest.approx(expected_us)
