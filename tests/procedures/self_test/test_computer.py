"""Self-test of the computer: each step measures, and each step can fail."""

import itertools
import time
from pathlib import Path

import numpy as np
import pytest

from exograv.errors import RecordingError
from exograv.procedures.self_test import computer
from exograv.procedures.self_test.computer import clock, disk, recorder
from exograv.storage.self_test_step import Step, tried, within, worst


def test_a_killed_recorder_is_replaced_and_loses_nothing(tmp_path: Path):
    lost, back = recorder(tmp_path, ("shoulder", "elbow"))
    assert (lost.passed, lost.measured) == (True, 0.0)
    assert back.passed
    assert list(tmp_path.iterdir()) == []


def test_a_clock_that_goes_back_is_refused(monkeypatch: pytest.MonkeyPatch):
    assert all(step.passed for step in clock())
    ticks = itertools.count()
    monkeypatch.setattr(time, "monotonic_ns", lambda: 10 * next(ticks) - 1000 * (next(ticks) > 5000))
    assert [step.passed for step in clock()] == [False]


def test_a_disk_without_room_for_twice_a_session_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    assert disk(tmp_path, 4)[0].passed
    monkeypatch.setattr(computer, "TRIAL_S", 1e9)
    (step,) = tried("disk", lambda: disk(tmp_path, 4))
    assert step.passed is False
    assert "Free" in step.what_to_do


def test_what_is_no_number_is_beyond_every_limit():
    for value in (float("nan"), float("inf"), 1.0001, -1.0001):
        assert not within("", value, 1.0, "", "act").passed
    assert within("", -1.0, 1.0, "", "act") == Step("", True, -1.0, 1.0, "", "")


def test_the_worst_joint_is_named_and_no_number_is_worst():
    assert worst(np.array([1.0, -3.0, 2.0]), "abc") == (-3.0, "b")
    assert worst(np.array([1.0, -3.0, np.nan]), "abc")[1] == "c"


def test_a_step_that_breaks_off_failed_and_says_what_to_do():
    def breaks() -> list[Step]:
        raise RecordingError("Give another folder.")

    assert tried("disk", breaks) == [Step("disk", False, what_to_do="Give another folder.")]
