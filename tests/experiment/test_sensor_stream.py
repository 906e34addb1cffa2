"""The acceleration of a sensor on Lab Streaming Layer opens and closes windows over the network."""

import threading
import time
from collections.abc import Iterator

import numpy as np
import pytest
from tests.lsl_network import VARIABLE, own_network

from exograv.errors import ConfigError, RecordingError
from exograv.experiment.aircraft import AircraftReceiver, Destination
from exograv.experiment.sensor_file.table import Names
from exograv.experiment.sensor_stream import Periods, Relayed, SensorStream, relay
from exograv.recording.stream_block import StreamBlock
from exograv.task.events import CloseWindow, OpenWindow
from exograv.task.task_settings import AircraftSettings

pylsl = pytest.importorskip("pylsl")

SETTINGS = AircraftSettings()
RATE_HZ = 100.0
GRAVITY = 9.80665
VERTICAL = np.array([0.6, -0.48, 0.64])


@pytest.fixture(scope="module", autouse=True)
def network(tmp_path_factory: pytest.TempPathFactory) -> Iterator[None]:
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv(VARIABLE, own_network(tmp_path_factory.mktemp("lsl")))
        yield


def level(t: float) -> float:
    """Return g: level flight for 2 s, weightless for 2.5 s, then a pull-up."""
    return 1.0 if t < 2.0 else 0.0 if t < 4.5 else 1.8


class Sensor:
    """Sensor that streams m/s² with its own names, from its start until its end."""

    def __init__(self, name: str, labels: tuple[str, ...], unit: str = "m/s^2", factor: float = GRAVITY):
        info = pylsl.StreamInfo(name, "ACC", len(labels), RATE_HZ, "float32", f"{name}-1")
        info.set_channel_labels(list(labels))
        if unit:
            info.set_channel_units([unit] * len(labels))
        self._outlet, self._axes = pylsl.StreamOutlet(info), [label[-1] in "XYZ" for label in labels]
        self._over, self._factor = threading.Event(), factor
        self._thread = threading.Thread(target=self._push)

    def __enter__(self) -> "Sensor":
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._over.set()
        self._thread.join()

    def _push(self) -> None:
        while not self._outlet.wait_for_consumers(0.05) and not self._over.is_set():
            pass
        begun = time.monotonic()
        for k in range(10**6):
            if self._over.wait(max(0.0, begun + k / RATE_HZ - time.monotonic())):
                return
            row, axes = np.full(len(self._axes), 7.0), np.array(self._axes)
            row[axes] = self._factor * level(k / RATE_HZ) * VERTICAL
            self._outlet.push_sample(row.tolist())


def relayed(receiver: AircraftReceiver, stream: SensorStream, seconds: float) -> tuple[list, Relayed]:
    """Relay a stream into the receiver, and return the events and the result."""
    said, results = [], []
    where = Destination(port=receiver.port)
    sender = threading.Thread(target=lambda: results.append(relay(stream, SETTINGS, 0.0, where, seconds, print)))
    sender.start()
    while sender.is_alive():
        said += receiver.receive(time.monotonic())
        time.sleep(0.02)
    return [*said, *receiver.receive(time.monotonic())], results[0]


@pytest.mark.long
def test_a_window_opens_and_closes_by_a_sensor_on_lsl():
    labels = ("temperature", "acc_X", "acc_Y", "acc_Z")
    with Sensor("IMU", labels), AircraftReceiver(SETTINGS, 0.0, port=0) as receiver:
        said, result = relayed(receiver, SensorStream("IMU"), 9.0)
    assert [type(one) for one in said if isinstance(one, OpenWindow | CloseWindow)] == [OpenWindow, CloseWindow]
    assert (receiver.refused, result.refused, result.connections) == (0, 0, 1)
    assert result.sent == receiver.heard > 40


@pytest.mark.long
def test_a_wrong_unit_and_a_missing_one_are_told():
    with Sensor("raw", ("acc_X", "acc_Y", "acc_Z"), unit="", factor=4.0 * GRAVITY):
        with pytest.raises(RecordingError, match=r"is stated\. Give it with --unit"):
            relay(SensorStream("raw"), SETTINGS, 0.0, Destination(), 5.0, print)
        with pytest.raises(ConfigError, match=r"not finite\. Correct --unit"):
            relay(SensorStream("raw", Names(unit="g")), SETTINGS, 0.0, Destination(), 5.0, print)


def blocks(stamps: np.ndarray, values: np.ndarray, connection: int = 1) -> StreamBlock:
    return StreamBlock(time.monotonic(), connection, stamps, values)


def test_each_period_is_the_mean_of_its_samples():
    periods = Periods([0, 1, 2], 1.0, SETTINGS, 0.0)
    stamps = 500.0 + np.arange(100) / RATE_HZ
    values = np.column_stack([np.sin(2 * np.pi * 10.0 * stamps), np.zeros(100), np.ones(100)])
    samples = [
        one for k in range(0, 100, 25) for one in periods.finished(blocks(stamps[k : k + 25], values[k : k + 25]))
    ]
    assert len(samples) in (9, 10)
    assert np.abs([one.g[0] for one in samples[1:]]).max() < 1e-9
    assert {one.g[2] for one in samples} == {1.0}


def test_samples_that_are_not_finite_out_of_order_or_too_large_are_refused():
    periods = Periods([0, 1, 2], 1.0, SETTINGS, 0.0)
    values = np.ones((5, 3))
    values[1], values[2] = np.nan, 11.0
    list(periods.finished(blocks(np.array([0.0, 0.01, 0.02, 0.03, 0.03]), values)))
    assert (periods.used, periods.refused) == (2, 3)


def test_a_restarted_sensor_with_another_clock_goes_on():
    periods = Periods([0, 1, 2], 1.0, SETTINGS, 0.0)
    stamps, values = np.arange(50) / RATE_HZ, np.ones((50, 3))
    first = list(periods.finished(blocks(1e6 + stamps, values)))
    second = list(periods.finished(blocks(stamps, values, connection=2)))
    assert periods.refused == 0
    assert min(len(first), len(second)) >= 4
