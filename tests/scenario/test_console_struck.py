"""The guard alone lets a floating arm down, or gives it back, in time after the session dies or the pages freeze.

The test shows hazards F30 and F31 on real processes, in real time.
"""

import os
import re
import signal
import time
from contextlib import suppress
from pathlib import Path

import numpy as np
import pytest
from tests.console.of_process import Page, console
from tests.waiting import wait_until
from websockets.exceptions import ConnectionClosed

from exograv.console.page_process import DESCRIPTORS_MAX
from exograv.experiment.steered.requests import LEASE_S
from exograv.recording import read_recording
from exograv.recording.reader import Recording
from exograv.safety.guard import SafeState
from exograv.safety.modes import RAMP_OUT_S

pytestmark = pytest.mark.slow

LATE_S = 0.5
"""Tolerance for the guard's check of its parent's line, on a busy computer."""

SOON_S = 120.0
OPTIONS = ("--level", "1", "--seed", "1001", "--identify", "10")


def floating(operator: Page) -> None:
    """Do both steps, and identify the arm."""
    for act, mode in (("make_ready", "exo_only"), ("identify", "moving")):
        operator.until(lambda a=act: a in operator.shown["possible"], SOON_S)
        assert operator.act(act, seen_version=operator.shown["version"])["taken"]
        operator.until(lambda m=mode: operator.shown["mode"] == m, SOON_S)
    operator.until(lambda: operator.shown["mode"] == "floating", SOON_S)


def whole(path: Path) -> Recording:
    """Wait until the recorder has completed the file."""

    def complete() -> Recording | None:
        recording = read_recording(path)
        return recording if recording.remark is None else None

    recording = wait_until(complete, "a complete file", SOON_S)
    assert recording is not None
    return recording


def first_s(recording: Recording, rows: np.ndarray, after_s: float) -> float:
    """Time from a moment on CLOCK_MONOTONIC to the first such tick after it [s]."""
    times = recording.ticks["monotonic"][rows]
    return float(times[times >= after_s][0]) - after_s


def comes_down(recording: Recording) -> np.ndarray:
    """Ticks in which a soft descent, or a harder safe state, was in force."""
    return recording.ticks["safe_state"].astype(int) - 1 >= SafeState.DESCENT


def test_a_console_that_is_killed_lets_the_arm_down_within_the_lease(tmp_path: Path):
    with console(*OPTIONS, "--out", tmp_path, module="tests.console.nominal_console") as (process, link):
        with Page(link) as operator:
            floating(operator)
            struck = time.monotonic()
            os.kill(process.pid, signal.SIGKILL)
        recording = whole(tmp_path / "steered-1.mcap")
    ticks, is_down = recording.ticks, comes_down(recording)
    before = np.flatnonzero(ticks["monotonic"] < struck)[-1]
    assert (ticks["arm_share"][before], is_down[before]) == (1.0, False)
    assert first_s(recording, is_down, struck) < LEASE_S
    assert is_down[-1]


def pages_of(parent: int) -> int:
    """Return the process of the pages: that with their limit of descriptors."""
    children = Path(f"/proc/{parent}/task/{parent}/children").read_text(encoding="ascii").split()
    limit = rf"Max open files +{DESCRIPTORS_MAX} "
    (pages,) = [pid for pid in children if re.search(limit, Path(f"/proc/{pid}/limits").read_text(encoding="ascii"))]
    return int(pages)


def test_pages_that_stand_still_have_the_arm_given_back_when_the_lease_ends_and_come_back(tmp_path: Path):
    struck = 0.0
    with console(*OPTIONS, "--out", tmp_path, module="tests.console.nominal_console") as (process, link):
        with Page(link) as operator, suppress(ConnectionClosed):
            floating(operator)
            struck = time.monotonic()
            os.kill(pages_of(process.pid), signal.SIGSTOP)
            time.sleep(LEASE_S + RAMP_OUT_S + 2.0 * LATE_S)
        with Page(link, login=operator.login) as operator:
            operator.until(lambda: operator.shown["mode"] == "exo_only", SOON_S)
            operator.until(lambda: any("No operator steers" in text for text in operator.alarms), SOON_S)
            os.kill(process.pid, signal.SIGKILL)
        recording = whole(tmp_path / "steered-1.mcap")
    ticks = recording.ticks
    begins = first_s(recording, ticks["arm_share"] < 1.0, struck)
    # The last heartbeat was up to one period before the freeze.
    assert LEASE_S - LATE_S < begins < LEASE_S + LATE_S
    assert first_s(recording, ticks["arm_share"] == 0.0, struck) - begins < RAMP_OUT_S + LATE_S
    still = (ticks["monotonic"] > struck) & (ticks["monotonic"] < struck + LEASE_S + RAMP_OUT_S)
    assert not comes_down(recording)[still].any()
