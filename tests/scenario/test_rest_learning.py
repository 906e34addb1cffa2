"""A session moves the relaxed arm in its rests, learns it, and carries no arm with a wider bound by decision."""

import json
import subprocess
import tomllib
from pathlib import Path

import numpy as np
import pytest
from tests.preloaded import exograv
from tests.scenario.test_train import WAIT_S, command, records, short, trained
from tests.waiting import wait_until

from exograv.procedures.identification.rest_learning import Verdict
from exograv.recording import read_recording


def three_windows(folder: Path) -> Path:
    """Write a protocol of three short windows, with rests that are long enough to learn."""
    protocol = short(folder, base="training", rest_s=14.0)
    text = protocol.read_text(encoding="utf-8").replace("count = 2", "count = 3")
    protocol.write_text(text, encoding="utf-8")
    return protocol


@pytest.mark.slow
def test_a_session_that_learns_in_rests_states_less_residual_torque_after_each_rest_and_replays(tmp_path: Path):
    protocol = three_windows(tmp_path)
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


@pytest.mark.slow
def test_a_session_with_emg_leaves_out_no_rest_of_a_restless_wearer(tmp_path: Path):
    protocol = three_windows(tmp_path)
    result = trained(tmp_path, "--protocol", str(protocol), "--learn-in-rests", "--emg", "--level", "3")
    first, second = result["learned"]
    assert second["motion_s"] > first["motion_s"] > 10.0
    assert Verdict.RESTLESS.value not in (first["verdict"], second["verdict"])


@pytest.mark.slow
def test_a_killed_session_continues_with_what_it_has_learned_and_the_next_day_starts_from_its_file(tmp_path: Path):
    file = tmp_path / "P-07.toml"
    words = "--protocol", str(three_windows(tmp_path)), "--learn-in-rests", "--person-file", str(file)
    kept = tmp_path / "P-07_short_01.simulated.run.json"
    with subprocess.Popen(command(tmp_path, *words), stderr=subprocess.DEVNULL, text=True) as process:

        def touches() -> int:
            assert process.poll() is None, "the run ended before it was killed"
            if not kept.exists():
                return 0
            state = json.loads(json.loads(kept.read_text())["run"])
            return int(state["touches"]) if len(state["windows"]) == 2 and state["windows"][1]["touches"] else 0

        try:
            told = wait_until(touches, "a touch in the second window", WAIT_S)
        finally:
            process.kill()
    before = json.loads(kept.read_text())["rests"]
    assert before["rests"] == 1
    assert not file.exists()
    result = trained(tmp_path, *words, "--resume")
    assert result["touches"] >= told
    recording = read_recording(Path(result["recording"]))
    assert [record["window"] for record in records(recording, "window_opened")] == [1, 2, 2, 3]
    first, second = result["learned"]
    assert first["motion_s"] == pytest.approx(before["motion_s"], abs=0.01)
    assert second["motion_s"] > first["motion_s"] + 10.0
    identified = tomllib.loads(file.read_text(encoding="utf-8"))["identified"]
    assert (identified["donnings"], identified["motion"]) == (1, "rests")
    assert result["person_kept"]
    tomorrow = trained(tmp_path, *words, "--session", "2", "--donning", "1")
    stated = [np.array(one["stated_Nm"]) for one in (*result["learned"], *tomorrow["learned"])]
    assert (stated[2] < stated[0]).all(), "the first rest of the second day starts from the file"
    assert tomllib.loads(file.read_text(encoding="utf-8"))["identified"]["donnings"] == 2
