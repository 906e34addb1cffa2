"""Recorded attempts: they are judged by the fingertip, and an unsuitable recording is refused with what is missing."""

from pathlib import Path

import pytest

from exograv.errors import RecordingError
from exograv.laboratory.support_level.support_level_command import run_recorded
from exograv.procedures.rehabilitation.support_level.recorded_attempts import recorded_attempts
from exograv.procedures.rehabilitation.support_level.targets import TARGETS, TIME_S
from exograv.recording import RecordingWriter
from exograv.results import json_value

JOINTS = ("flexion", "abduction", "rotation", "elbow")
PLACE = [0.5, -0.2, 0.3]
SETTINGS = {
    "rig": "recupera_like_qdd",
    "side": "right",
    "command": "exograv run support-level",
    "disturbance_level": 2,
    "seed": 1000,
}


def write(
    path: Path, attempts: list[tuple[float, float]], settings: dict[str, object] = SETTINGS, **change: object
) -> Path:
    """Write attempts with these supports and distances of the fingertip from the target [m]."""
    with RecordingWriter(path, JOINTS, settings) as recording:
        t = 0.0
        for k, (support, off) in enumerate(attempts):
            record = {"target": k % 12, "targets": len(TARGETS), "support": support, "place_m": PLACE} | change
            recording.write("/task", t, {"kind": "reach_began", "record": record})
            for step in range(40):
                tip = [PLACE[0], PLACE[1] + off, PLACE[2]]
                recording.write("/skeleton", t + 0.02 * (step + 1), {"exo": [tip], "arm": [tip, tip]})
            t += TIME_S
            recording.write("/task", t, {"kind": "reach_ended", "record": record})
    return path


def test_attempts_are_judged_by_the_fingertip_and_not_by_what_the_session_said(tmp_path: Path):
    tried, is_simulated = recorded_attempts(write(tmp_path / "a.mcap", [(0.9, 0.01), (0.4, 0.2)]))
    assert tried == [(0, 0.9, True), (1, 0.4, False)]
    assert is_simulated


def test_a_recording_of_a_machine_that_was_no_twin_is_not_called_simulated(tmp_path: Path):
    real = {name: value for name, value in SETTINGS.items() if name != "disturbance_level"}
    _, is_simulated = recorded_attempts(write(tmp_path / "a.mcap", [(0.9, 0.01), (0.4, 0.2)], real))
    assert not is_simulated


@pytest.mark.slow
def test_support_needed_lies_between_where_all_and_where_nothing_was_reached(tmp_path: Path):
    attempts = [(support, 0.01 if support > 0.5 else 0.3) for support in (0.8, 0.6, 0.4, 0.2) for _ in range(12)]
    result = run_recorded(write(tmp_path / "a.mcap", attempts), tmp_path, "recorded")
    found = result.outcome
    assert found.support_percent is not None
    assert 40.0 < found.support_percent < 65.0
    assert found.ci95[0] <= found.support_percent <= found.ci95[1]
    assert {"support_percent", "ci95", "reached", "targets", "figure"} <= json_value(result).keys()
    assert "SIMULATED" in result.figure.read_text(encoding="utf-8")


def test_a_recording_without_attempts_says_what_it_takes(tmp_path: Path):
    with pytest.raises(RecordingError, match=r"contains no attempts at targets\. A recording for this holds"):
        recorded_attempts(write(tmp_path / "a.mcap", []))


def test_one_support_alone_says_nothing_between(tmp_path: Path):
    with pytest.raises(RecordingError, match="2 complete attempts at 1 support; 2 supports"):
        recorded_attempts(write(tmp_path / "a.mcap", [(0.9, 0.01), (0.9, 0.2)]))


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"targets": 9}, "target 0 of 9; the set has 12"),
        ({"support": 1.5}, "support 1.5; allowed: 0 to 1"),
    ],
)
def test_other_targets_and_impossible_supports_are_refused(tmp_path: Path, change: dict, message: str):
    with pytest.raises(RecordingError, match=message):
        recorded_attempts(write(tmp_path / "a.mcap", [(0.9, 0.01), (0.4, 0.2)], **change))
