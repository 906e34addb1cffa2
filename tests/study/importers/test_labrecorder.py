"""Files that LabRecorder itself writes give our touches, and the acceleration of a flight.

The package `labrecorder` of the Python registry holds its library (tests/peers_python.py).
"""

import json
import subprocess
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
from tests.experiment.sensor_file.made_up_flights import RATE_HZ, acceleration
from tests.experiment.sensor_file.test_load import assert_both_windows_open_and_close
from tests.lsl_network import VARIABLE, own_network
from tests.peers_python import own_environment, peers_python
from tests.study.made_up_sessions import run_records

from exograv.experiment.sensor_file.load import SensorFile, load_flight
from exograv.experiment.sensor_file.table import Names
from exograv.study.importers.xdf import OURS, import_xdf
from exograv.task.task_settings import AircraftSettings

pylsl = pytest.importorskip("pylsl")
PYTHON = peers_python("labrecorder", "pylsl")

PEER = Path(__file__).with_name("labrecorder_process.py")
SOON_S = 20.0


@pytest.fixture(scope="module", autouse=True)
def network(tmp_path_factory: pytest.TempPathFactory) -> Iterator[None]:
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv(VARIABLE, own_network(tmp_path_factory.mktemp("lsl")))
        yield


@contextmanager
def recorded(path: Path, outlet) -> Iterator[None]:
    """Record a stream with LabRecorder while the block runs."""
    command = [PYTHON, PEER, path, outlet.get_info().name()]
    with subprocess.Popen(
        command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, env=own_environment()
    ) as peer:
        try:
            assert outlet.wait_for_consumers(SOON_S)
            yield
            peer.communicate("", timeout=SOON_S)
        finally:
            peer.kill()
    assert peer.returncode == 0


def imu():
    """Open the stream of a sensor that states its channels and units."""
    info = pylsl.StreamInfo("Cabin IMU", "Accelerometer", 3, RATE_HZ, pylsl.cf_float32, "imu-1")
    channels = info.desc().append_child("channels")
    for axis in "xyz":
        channel = channels.append_child("channel")
        channel.append_child_value("label", f"acc_{axis}")
        channel.append_child_value("unit", "g")
    return pylsl.StreamOutlet(info, max_buffered=600)


def test_our_markers_give_their_touches_again_from_a_file_of_labrecorder(tmp_path: Path):
    markers = pylsl.StreamOutlet(pylsl.StreamInfo(OURS, "Markers", 1, 0.0, pylsl.cf_string, "markers-1"))
    records, begun = run_records(), pylsl.local_clock()
    with recorded(tmp_path / "lab.xdf", markers):
        for k, record in enumerate(records):
            markers.push_sample([json.dumps(record)], begun + k)
    found = import_xdf(tmp_path / "lab.xdf")
    touched = [record["t"] - records[0]["t"] for record in records if record["kind"] == "touch"]
    assert found.refusals == []
    assert [row["t_s"] for row in found.touches] == pytest.approx(touched)


def test_a_sensor_that_labrecorder_recorded_opens_and_closes_the_windows_of_its_flight(tmp_path: Path):
    sensor, (t, g), begun = imu(), acceleration(), pylsl.local_clock()
    with recorded(tmp_path / "lab.xdf", sensor):
        for begin in range(0, len(t), 1000):
            part = slice(begin, begin + 1000)
            sensor.push_chunk(g[part].tolist(), (begun + t[part]).tolist())
    flight = load_flight(SensorFile(tmp_path / "lab.xdf", Names(), "Cabin IMU"), AircraftSettings(), 0.0)
    assert (flight.refused, flight.gaps) == (0, 0)
    assert flight.samples[-1][0] == pytest.approx(t[-1], abs=0.2)
    assert_both_windows_open_and_close(flight)
