"""A session moves the relaxed arm in its rests, learns it, and carries no arm with a wider bound by decision."""

from pathlib import Path

import numpy as np
import pytest
from tests.preloaded import exograv
from tests.scenario.test_train import records, short, trained

from exograv.recording import read_recording


@pytest.mark.slow
def test_a_session_that_learns_in_rests_states_less_residual_torque_after_each_rest_and_replays(tmp_path: Path):
    protocol = short(tmp_path, base="training", rest_s=14.0)
    text = protocol.read_text(encoding="utf-8").replace("count = 2", "count = 3")
    protocol.write_text(text, encoding="utf-8")
    result = trained(tmp_path, "--protocol", str(protocol), "--learn-in-rests")
    assert result["is_complete"]
    assert result.get("identification") is None
    recording = read_recording(Path(result["recording"]))
    told = [event for event in recording.messages("/event") if event["kind"] == "rest learning"]
    assert len(told) == len(result["learned"]) == 2
    assert [one["why"] for one in records(recording, "paused")] == ["learning in the rest"] * 2
    first, second = (np.array(one["stated_Nm"]) for one in result["learned"])
    assert (second <= first).all()
    exograv("data", "replay", result["recording"], check=True)
