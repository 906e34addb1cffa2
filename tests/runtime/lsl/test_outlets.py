"""Published samples have the time of their measurement, name no person, and come back with the recorder."""

import contextlib
import os
import signal
import time
from pathlib import Path

import numpy as np
import pytest
from tests.waiting import wait_until

from exograv.errors import ConfigError
from exograv.recording import read_recording
from exograv.recording.encoding import tick_dtype
from exograv.runtime.lsl.library import lsl
from exograv.runtime.lsl.outlets import OutletsJob
from exograv.runtime.recorder.recorder import Recorder
from exograv.runtime.recorder.recorder_process import PHASE, event

JOINTS = ("shoulder_flexion", "elbow_flexion")
SETTINGS = {"rig": "recupera_like", "wearer": {"name": "Ada Example", "mass_kg": 61.0}}
AHEAD_S = 5e4
"""Lead of the rig's clock over CLOCK_MONOTONIC in this test [s]."""

OLD_S = 0.004
"""Time from a measurement to the decision [s]."""


class Loop:
    """Mock of the guard that puts ticks measured now."""

    def __init__(self, recorder: Recorder):
        self._ticks, self._events, self.put_in = recorder.inlet.ticks(), recorder.inlet.events(), list[np.ndarray]()

    def tick(self) -> None:
        row = np.zeros((), tick_dtype(len(JOINTS)))
        row["cdr_header"] = (0, 1, 0, 0)
        row["monotonic"] = time.monotonic()
        row["now"] = row["monotonic"] + AHEAD_S
        row["t"] = row["now"] - OLD_S
        row["sequence"] = len(self.put_in) + 1
        row["q_measured"], row["tau_commanded"] = (0.1, 0.2), (3.0, -len(self.put_in))
        self._ticks.put(row)
        self.put_in.append(row)

    def say(self, kind: str, text: str) -> float:
        now = time.monotonic()
        self._events.put(event(now + AHEAD_S, kind, text))
        return now

    def close(self) -> None:
        self._ticks.close()
        self._events.close()


@pytest.fixture
def job() -> OutletsJob:
    return OutletsJob("recupera_like", JOINTS, 0.001)


@pytest.fixture
def run(tmp_path: Path, job: OutletsJob):
    with (
        Recorder(tmp_path / "a.mcap", JOINTS, SETTINGS, 5.0, outlets=job) as recorder,
        contextlib.closing(Loop(recorder)) as loop,
    ):
        yield recorder, loop


def inlet(job: OutletsJob, kind: str, recover: bool = False):
    """Open the inlet of a consumer in another process than the recorder's."""
    found = lsl().resolve_byprop("source_id", f"exograv-{job.token}-{kind}", 1, 10.0)
    assert len(found) == 1
    opened = lsl().StreamInlet(found[0], recover=recover)
    opened.open_stream(10.0)
    return opened


def received(stream, wanted: int) -> tuple[list, list[float]]:
    values, stamps = [], list[float]()

    def is_whole() -> bool:
        new, times = stream.pull_chunk()
        values.extend(new)
        stamps.extend(times)
        return len(stamps) >= wanted

    wait_until(is_whole, f"{wanted} samples")
    return values, stamps


def test_the_clock_of_lsl_is_the_monotonic_one():
    lsl().local_clock()
    gaps = [(time.monotonic(), lsl().local_clock(), time.monotonic()) for _ in range(20)]
    assert all(before <= between <= after for before, between, after in gaps)


def test_a_stamp_is_the_time_of_the_measurement_and_not_of_sending(run, job: OutletsJob):
    _, loop = run
    joints, torque = inlet(job, "jointstate"), inlet(job, "torque")
    for _ in range(30):
        loop.tick()
        time.sleep(0.003)
    true = [float(row["monotonic"]) - OLD_S for row in loop.put_in]
    values, stamps = received(joints, 30)
    np.testing.assert_allclose(stamps, true, rtol=0.0, atol=1e-9)
    np.testing.assert_allclose(np.array(values)[:, 0], [row["t"] for row in loop.put_in], rtol=0.0, atol=0.0)
    np.testing.assert_array_equal(np.array(values)[:, 1], np.arange(1, 31))
    np.testing.assert_array_equal(np.array(values)[:, 2:4], [[0.1, 0.2]] * 30)
    values, stamps = received(torque, 30)
    np.testing.assert_allclose(stamps, true, rtol=0.0, atol=1e-9)
    np.testing.assert_array_equal(np.array(values)[:, 5], -np.arange(30.0))  # second joint, commanded


def test_a_marker_has_the_time_of_its_event(run, job: OutletsJob):
    _, loop = run
    markers = inlet(job, "markers")
    loop.tick()
    said = [loop.say(PHASE, "floating"), loop.say("stop", "Größer als ½")]
    time.sleep(0.05)  # no tick is late enough yet
    loop.tick()
    texts, stamps = received(markers, 2)
    assert texts == [["phase: floating"], ["stop: Größer als ½"]]
    np.testing.assert_allclose(stamps, said, rtol=0.0, atol=1e-6)  # the rig's clock has fewer digits


def test_ticks_of_a_virtual_clock_are_recorded_and_not_published(run, job: OutletsJob):
    recorder, loop = run
    joints = inlet(job, "jointstate")
    ring = recorder.inlet.ticks()
    row = np.zeros((), tick_dtype(len(JOINTS)))
    row["monotonic"] = np.nan
    ring.put(row)
    ring.close()
    loop.tick()
    values, _ = received(joints, 1)
    assert [value[1] for value in values] == [1.0]
    assert recorder.finish().acknowledged == 2


def test_a_description_has_joint_and_unit_and_no_name_of_a_person(run, job: OutletsJob):
    xml = inlet(job, "torque").info(10.0).as_xml()
    assert "<label>tau_desired/elbow_flexion</label>" in xml
    assert xml.count("<unit>N·m</unit>") == 6
    assert "recupera_like" in xml
    assert "Ada" not in xml
    assert "61" not in xml.split("<desc>")[1]


def test_a_killed_recorder_loses_no_tick_and_its_streams_are_found_again(run, job: OutletsJob):
    recorder, loop = run
    joints = inlet(job, "jointstate", recover=True)
    for _ in range(20):
        loop.tick()
    received(joints, 20)
    os.kill(recorder.pid, signal.SIGKILL)
    back = list[float]()

    def is_back() -> bool:
        recorder.check()
        loop.tick()
        back.extend(joints.pull_chunk()[1])
        return len(back) > 5

    wait_until(is_back, "samples of another recorder")
    report = recorder.finish()
    assert (report.restarts, report.lost, report.unpublished) == (1, 0, "")
    assert read_recording(recorder.path).ticks["sequence"].tolist() == list(range(1, len(loop.put_in) + 1))
    assert np.all(np.diff(back) > 0)  # no sample is repeated
    assert back[0] > float(loop.put_in[19]["monotonic"])


def test_without_lsl_the_error_says_how_to_install_it(tmp_path: Path, job: OutletsJob, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr("importlib.util.find_spec", lambda name: None)
    with pytest.raises(ConfigError, match=r"pip install 'exograv\[lsl\]'"):
        Recorder(tmp_path / "a.mcap", JOINTS, SETTINGS, 5.0, outlets=job)
    assert not (tmp_path / "a.mcap").exists()
