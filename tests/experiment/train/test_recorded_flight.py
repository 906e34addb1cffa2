"""A flight that a sensor recorded opens the windows of a session on the twin; other files are refused before it."""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from tests.experiment.sensor_file.made_up_flights import acceleration

from exograv.errors import ConfigError
from exograv.experiment.train.options import TrainOptions
from exograv.experiment.train.train_command import run_training
from exograv.recording import read_recording

HEAD = ["Time (s)", "Acc X (g)", "Acc Y (g)", "Acc Z (g)"]


@pytest.fixture(scope="module")
def flight(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("flight") / "imu.csv"
    t, g = acceleration(parabolas=1)
    pd.DataFrame(np.column_stack([t, g]), columns=HEAD).to_csv(path, index=False)
    return path


def options(flight: Path, **more) -> TrainOptions:
    return TrainOptions(**{"participant": "P-01", "protocol": "flight", "windows": 1, "aircraft_file": flight} | more)


@pytest.mark.slow
def test_the_window_of_a_recorded_parabola_is_opened_by_the_recording_and_completed(flight: Path, tmp_path: Path):
    result = run_training(options(flight), tmp_path, lambda _what, _share: None, None)
    assert (result.is_complete, result.attempts) == (True, 1)
    recording = read_recording(result.recording)
    records = [message["record"] for message in recording.messages("/task")]
    assert [record["by"] for record in records if record["kind"] == "window_opened"] == ["aircraft"]
    assert [record["by"] for record in records if record["kind"] == "window_closed"] == ["aircraft"]
    felt = [np.linalg.norm(message["g"]) for message in recording.messages("/aircraft")]
    assert min(felt) < 0.1
    assert max(felt) > 1.7


def test_a_flight_with_fewer_windows_than_the_protocol_is_refused_with_their_number(flight: Path, tmp_path: Path):
    with pytest.raises(ConfigError, match=r"has 1 windows .* which has 2\. Give --windows 1"):
        run_training(options(flight, windows=2), tmp_path, lambda _what, _share: None, None)


def test_a_flight_for_a_protocol_of_the_clock_is_refused(flight: Path, tmp_path: Path):
    with pytest.raises(ConfigError, match="opens its windows by the clock"):
        run_training(options(flight, protocol="training"), tmp_path, lambda _what, _share: None, None)
