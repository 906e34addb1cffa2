"""An emulated flight reaches the receiver over the network. Other senders to its port have no effect."""

import socket
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from tests.experiment.sensor_file.made_up_flights import acceleration

from exograv.errors import ConfigError
from exograv.experiment.aircraft import AircraftReceiver, Destination, Emulation, emulate, listen, replay, sentence
from exograv.experiment.sensor_file.load import SensorFile, load_flight
from exograv.task.aircraft_line import clock_of
from exograv.task.events import CloseWindow, FeedBack, FeedLost, OpenWindow
from exograv.task.flight_profile import FlightProfile, Network
from exograv.task.task_settings import AircraftSettings

SETTINGS = AircraftSettings()


def line(level: float, k: int) -> bytes:
    ms = 34_000_000 + 100 * k
    return f"{ms};{clock_of(ms)};0.0;0.0;{level};19;46.2;944;3;UNKNOWN".encode()


def received(receiver: AircraftReceiver, datagrams: list[bytes], begun: float = 0.0) -> list:
    """Receive lines one by one, ten per second, and return the events."""
    said = []
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender:
        for k, datagram in enumerate(datagrams):
            sender.sendto(datagram, ("127.0.0.1", receiver.port))
            said += receiver.receive(begun + 0.1 * k)
    return said


def test_windows_open_and_close_by_what_comes_over_the_network():
    levels = [1.0] * 5 + [0.0] * 20 + [1.8] * 10
    with AircraftReceiver(SETTINGS, 0.0, port=0) as receiver:
        said = received(receiver, [line(level, k) for k, level in enumerate(levels)])
        assert [type(one) for one in said] == [OpenWindow, CloseWindow]
        assert receiver.heard == len(levels)
        assert [type(one) for one in receiver.receive(60.0)] == [FeedLost]
    assert "parabola 3, announcement unknown" in sentence(said[0])


def test_noise_on_the_port_is_counted_and_changes_nothing():
    noise = [b"", b"\xff" * 300, b";" * 2000, b"hello;world"]
    with AircraftReceiver(SETTINGS, 0.0, port=0) as receiver:
        said = received(receiver, [one for k in range(20) for one in (line(1.0, k), *noise)])
        assert said == []
        assert (receiver.heard, receiver.refused) == (20, 80)
        assert "2 fields" in receiver.why_refused


def test_another_sender_than_the_named_one_is_not_believed():
    with AircraftReceiver(SETTINGS, 0.0, port=0, sender="192.0.2.1") as receiver:
        received(receiver, [line(0.0, k) for k in range(20)])
        assert (receiver.heard, receiver.foreign, receiver.is_window) == (0, 20, False)


def test_a_flight_that_is_sent_is_heard():
    profile = FlightProfile(parabolas=1, before_s=0.5, ramp_s=0.5, hyper_s=0.5, window_s=2.0, after_s=1.0)
    with AircraftReceiver(SETTINGS, 0.0, port=0) as receiver:
        sent = emulate(Emulation(profile, Network(), Destination(port=receiver.port, speed=1000.0)), lambda _: None)
        receiver.receive(0.0)
        assert receiver.heard == min(sent, 64)
        assert sent == round(10 * profile.cycle_s)


def test_a_recorded_flight_that_is_sent_opens_and_closes_its_windows(tmp_path: Path):
    t, g = acceleration()
    pd.DataFrame(np.column_stack([t, g]), columns=["Time (s)", "Acc X (g)", "Acc Y (g)", "Acc Z (g)"]).to_csv(
        tmp_path / "flight.csv", index=False
    )
    flight = load_flight(SensorFile(tmp_path / "flight.csv"), SETTINGS, 0.0)
    said = []
    with AircraftReceiver(SETTINGS, 0.0, port=0) as receiver:
        for begun in range(0, len(flight.samples), 50):
            part = replace(flight, samples=flight.samples[begun : begun + 50])
            sent = replay(part, Destination(port=receiver.port, speed=1000.0), lambda _: None)
            said += receiver.receive(0.1 * begun)
            assert sent == len(part.samples)
        assert receiver.heard == len(flight.samples)
    assert [type(one) for one in said if not isinstance(one, FeedLost | FeedBack)] == [OpenWindow, CloseWindow] * 2


@pytest.mark.parametrize("speed", [0.0, -1.0, float("nan"), 1e9])
def test_a_speed_that_cannot_be_is_refused(speed: float):
    with pytest.raises(ConfigError, match="--speed"):
        emulate(Emulation(FlightProfile(), Network(), Destination(speed=speed)), lambda _: None)


def test_an_impossible_time_to_listen_is_refused():
    with pytest.raises(ConfigError, match="--seconds"):
        listen(AircraftReceiver(SETTINGS, 0.0, port=0), -1.0, lambda _: None)


def test_a_port_that_is_not_to_be_had_is_refused_with_the_next_step():
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as other:
        other.bind(("", 0))
        with (
            pytest.raises(ConfigError, match="Give another --port"),
            AircraftReceiver(SETTINGS, 0.0, port=other.getsockname()[1]),
        ):
            pass
