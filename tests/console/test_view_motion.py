"""The page of a recording shows the recorded motion, and says who measured what is left over."""

import json
from dataclasses import asdict, replace
from pathlib import Path

import numpy as np
import pytest
from tests.peaks import largest_peak_bytes

from exograv.console import view_motion
from exograv.console.view_motion import PREDICTED, TRUE, motion_of
from exograv.console.view_recording import recorded_view
from exograv.errors import ConfigError, RecordingError
from exograv.recording import Recording, open_recording, read_recording, stored_messages
from memory import write_long

FLOATING = Path("examples/data/floating.mcap")
ROUNDED_RAD = 1e-4


@pytest.fixture(scope="module")
def recording() -> Recording:
    return read_recording(FLOATING)


def test_frames_are_recorded_ticks_in_order_and_from_the_first_to_the_last(recording: Recording):
    motion, ticks = motion_of(recording), recording.ticks
    t = np.array(motion.t)
    assert (np.diff(t) > 0.0).all()
    assert (t[0], t[-1]) == pytest.approx((0.0, ticks["t"][-1] - ticks["t"][0]), abs=2e-3)
    rows = np.searchsorted(ticks["t"], t + ticks["t"][0] - 5e-4)
    np.testing.assert_allclose(motion.q, ticks["q_measured"][rows], atol=ROUNDED_RAD)


def test_a_long_recording_has_no_more_frames_than_a_page_can_take(
    recording: Recording, monkeypatch: pytest.MonkeyPatch
):
    monkeypatch.setattr(view_motion, "FRAMES_MAX", 50)
    motion = motion_of(recording)
    assert len(motion.t) <= 50
    assert len(motion.arm.t) <= 50


@pytest.mark.long
def test_memory_of_a_motion_grows_by_at_most_eight_bytes_per_tick(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(view_motion, "FRAMES_MAX", 50)
    monkeypatch.setattr(stored_messages, "IN_MEMORY_BYTES", 1000)
    counts = (5_000, 20_000)
    for ticks in counts:
        write_long(tmp_path / f"{ticks}.mcap", ticks)
    motion_of(open_recording(tmp_path / "20000.mcap"))  # what the first use imports and keeps is not part of a motion
    paths = [tmp_path / f"{ticks}.mcap" for ticks in counts]
    short, long = (largest_peak_bytes(lambda path=path: motion_of(open_recording(path))) for path in paths)
    assert long - short < 8 * (counts[1] - counts[0])


def test_a_motion_from_the_file_is_the_motion_from_memory(recording: Recording):
    assert motion_of(open_recording(FLOATING)) == motion_of(recording)


def test_numbers_that_are_missing_become_null_and_the_page_stays_valid_json(recording: Recording):
    ticks = recording.ticks.copy()
    ticks["tau_measured"][:] = np.nan
    ticks["q_measured"][:100] = np.nan
    motion = motion_of(replace(recording, ticks=ticks))
    assert motion.tau_measured[0] == [None] * 4
    json.dumps(asdict(motion), allow_nan=False)


def test_a_weightless_arm_that_is_carried_feels_nothing_and_one_that_is_not_feels_all(recording: Recording):
    ticks = recording.ticks.copy()
    ticks["gravity_level"][:] = 0.0
    for share, felt in ((1.0, 0.0), (0.0, 1.0), (0.25, 0.75)):
        ticks["arm_share"][:] = share
        assert set(motion_of(replace(recording, ticks=ticks)).felt) == {felt}


def test_what_an_examiner_measured_is_told_from_what_the_estimator_expects(recording: Recording):
    expected = [{"t": 310.0, "predicted_left_over_Nm": [0.1] * 4}, {"t": 311.0, "predicted_left_over_Nm": None}]
    measured = [{"t": 312.0, "total": [0.2] * 4}]
    motion = motion_of(replace(recording, _messages={"/estimate": expected}))
    assert [(row.Nm, row.about) for row in motion.left_over] == [([0.1] * 4, PREDICTED)]
    motion = motion_of(replace(recording, _messages={"/estimate": expected, "/left_over": measured}))
    assert [(row.Nm, row.about) for row in motion.left_over] == [([0.2] * 4, TRUE)]


def test_a_recording_is_shown_with_the_machine_and_the_person_that_it_holds():
    data = recorded_view(FLOATING, None, None)
    assert data.is_simulated
    assert data.scene.arms[0].lengths == pytest.approx((0.25361, 0.26918, 0.177), abs=1e-4)
    assert data.scene.joints[3].p[2] == pytest.approx(-0.25361, abs=1e-4)


def test_a_recording_without_its_machine_asks_for_it_and_refuses_another_one():
    old = Path("tests/recording/data/version_3.mcap")
    with pytest.raises(RecordingError, match="--rig recupera_like"):
        recorded_view(old, None, None)
    with pytest.raises(RecordingError, match="shoulder_flexion, elbow_flexion; recupera_like has"):
        recorded_view(old, "recupera_like", None)
    with pytest.raises(ConfigError, match="No machine 'nothing'"):
        recorded_view(FLOATING, "nothing", None)
