"""A replay compares the whole guard with its recorded states, and goes on with them after a gap."""

import base64
import zlib
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from exograv.errors import RecordingError
from exograv.recording import read_recording
from exograv.recording.guard_state import state_in

from .conftest import GUARD_EVERY_S, Flown
from .test_lockstep_replay import replayed, rewritten


def packed(numbers: np.ndarray) -> str:
    return base64.b64encode(zlib.compress(numbers.tobytes())).decode()


def test_all_recorded_states_of_the_guard_equal_those_of_the_replay(flown: Flown):
    recording = read_recording(flown.path)
    seconds = len(recording.ticks) * 0.001
    found = replayed(flown.path)["guard_states"]
    assert found["equal"] == len(recording.messages("/guard")) > seconds / GUARD_EVERY_S - 1
    assert found["differ_s"] == []
    assert found["continued"] == 0


def test_a_single_number_of_a_state_that_differs_is_found_though_all_torques_agree(flown: Flown, tmp_path: Path):
    source = read_recording(flown.path)
    chosen = source.messages("/guard")[3]

    def change(topic: str, message: dict[str, Any]) -> dict[str, Any]:
        if topic == "/guard" and message["now"] == chosen["now"]:
            state = state_in(message).copy()
            state[-1] += 1e-9
            message["state"] = packed(state)
        return message

    found = replayed(rewritten(flown, tmp_path / "a.mcap", source.ticks, change))
    assert found["guard_states"]["differ_s"] == [pytest.approx(chosen["now"])]
    assert not found["ok"]


def test_after_a_gap_the_guard_goes_on_from_its_recorded_state(flown: Flown, tmp_path: Path):
    source = read_recording(flown.path)
    found = replayed(rewritten(flown, tmp_path / "a.mcap", np.delete(source.ticks, np.r_[700:720])))
    after = [message for message in source.messages("/guard") if message["now"] > source.ticks["now"][719]]
    assert found["guard_states"]["continued"] == len(after) > 3
    assert found["guard_states"]["differ_s"] == []
    assert found["safe_state_differs"]["ticks"] == 0


def test_states_of_another_version_of_the_guard_are_not_compared_and_it_is_said(flown: Flown, tmp_path: Path):
    source = read_recording(flown.path)

    def change(topic: str, message: dict[str, Any]) -> dict[str, Any]:
        return message | {"version": "0badcafe"} if topic == "/guard" else message

    found = replayed(rewritten(flown, tmp_path / "a.mcap", source.ticks, change))
    assert found["ok"]
    assert found["guard_states"]["equal"] == 0
    assert "The guard of the run has version 0badcafe" in " ".join(found["circumstances"])


@pytest.mark.parametrize(
    "text",
    ["not base 64 !", base64.b64encode(b"no zlib").decode(), packed(np.zeros(3))[:-8], packed(np.zeros(200_000))],
)
def test_a_state_that_cannot_be_unpacked_is_a_damaged_file(text: str):
    with pytest.raises(RecordingError, match="damaged"):
        state_in({"now": 1.0, "state": text})
