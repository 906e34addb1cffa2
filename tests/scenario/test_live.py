"""A killed process of a live run is noticed, the arm comes down, and recorded samples stay recorded."""

import os
import signal
import threading
import time
from pathlib import Path

import numpy as np
import pytest

from exograv.api.rig_factory import run_live
from exograv.live.live_figures import LiveFigures, stall_ms
from exograv.live.live_processes import Running
from exograv.live.options import LiveOptions
from exograv.recording import read_recording
from exograv.runtime.clock.timing import LoopOutcome, Timing
from exograv.safety.stops import StopReason

SECONDS = 8.0
FLOATS_S = 9.0  # The arm floats after a second of rest and a ramp of five seconds.


def lived(folder: Path, kill: str | None, after_s: float = 2.0, seconds: float = SECONDS) -> LiveFigures:
    """Run in which one process is killed."""

    def started(running: Running) -> None:
        pid = {"control": running.control.pid, "recorder": running.recorder.pid, None: None}[kill]

        def strike() -> None:
            time.sleep(after_s)
            if pid is not None:
                os.kill(pid, signal.SIGKILL)

        threading.Thread(target=strike, daemon=True).start()

    return run_live(LiveOptions(seconds=seconds), folder, lambda _text, _share: None, started)


@pytest.mark.slow
def test_when_control_is_killed_the_guard_lets_the_arm_down_and_the_recording_goes_on(tmp_path: Path):
    result = lived(tmp_path, "control")
    assert StopReason.CONTROL_SILENT.value in [latch.cause for latch in result.latches]
    assert result.samples_lost == 0
    recording = read_recording(tmp_path / "live.mcap")
    ticks = recording.ticks
    assert len(ticks["t"]) == result.samples_recorded == result.ticks
    stopped = next(event["t"] for event in recording.messages("/event") if event["kind"] == "stop")
    tau = np.abs(ticks["tau_commanded"]).max(axis=1)
    assert tau[(ticks["t"] > stopped) & (ticks["t"] < stopped + 3.5)].min() < 0.1 * tau[ticks["t"] <= stopped][-1]


@pytest.mark.slow
def test_another_control_takes_the_arm_only_after_a_reset_and_by_a_ramp(tmp_path: Path):
    result = lived(tmp_path, "control", after_s=FLOATS_S, seconds=40.0)
    assert result.control_restarts == 1
    assert result.samples_lost == 0
    recording = read_recording(tmp_path / "live.mcap")
    names = [phase["name"] for phase in recording.messages("/phase")]
    stopped = names.index("safe")
    assert names[stopped - 1] == "floating"
    assert names[stopped : stopped + 5] == ["safe", "off", "self_test", "exo_only", "ramp_in"]
    resets = [event["t"] for event in recording.messages("/event") if "reset" in event["text"]]
    taken = recording.messages("/phase")[stopped + 4]["t"]
    assert resets
    assert resets[0] <= taken


@pytest.mark.slow
def test_when_the_recorder_is_killed_nothing_is_lost_and_the_arm_floats_on(tmp_path: Path):
    result = lived(tmp_path, "recorder")
    assert result.recorder_restarts == 1
    assert result.samples_lost == 0
    assert len(read_recording(tmp_path / "live.mcap").ticks["t"]) == result.ticks


def timing(periods: list[int], command_us: list[float]) -> Timing:
    lateness = np.array([round(1e3 * us) for us in command_us])
    return Timing(
        np.array(periods), lateness, np.zeros_like(lateness), periods[-1] + 1, 1_000_000, LoopOutcome.COMPLETE
    )


def test_a_latch_is_put_down_to_the_longest_gap_just_before_it():
    run = timing([0, 1, 2, 3, 9, 10, 11, 100], [0.0] * 8)
    assert stall_ms(run, 9) == pytest.approx(6.0)
    assert stall_ms(run, 11) == pytest.approx(6.0)
    assert stall_ms(run, 3) == pytest.approx(1.0)
