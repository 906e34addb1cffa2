"""A flight that any sensor recorded opens and closes the windows of its parabolas; other files are refused by name."""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from scipy.io import savemat
from tests.experiment.sensor_file.made_up_flights import CLOSES_S, CORNERS_S, OPENS_S, RATE_HZ, acceleration
from tests.study.importers.xdf_file import stream, write_xdf

from exograv.errors import RecordingError
from exograv.experiment.sensor_file.load import LoadedFlight, SensorFile, load_flight
from exograv.experiment.sensor_file.series import STANDARD_GRAVITY
from exograv.experiment.sensor_file.table import Names
from exograv.task.aircraft_watch import AircraftWatch
from exograv.task.events import CloseWindow, OpenWindow
from exograv.task.task_settings import AircraftSettings

SETTINGS = AircraftSettings()
FEED_S = 0.1
"""Period of the aircraft's feed, in which the sensor's values are averaged."""

VECTORNAV = (
    "$VNIMU,-00.0350,+00.4222,-00.6643,-00.015,+00.019,+09.948,+00.002066,-00.008442,-00.044656,+20.7,+084.322*66"
)
"""Sentence of a real VN-200, as its users have published it."""

NOVESPACE = """34439807;33:59.8;0.18307;-0.013731;0.950486;19;46.2;944;0;STEADY FLIGHT
34439908;33:59.9;0.181535;-0.013477;0.947214;19;46.2;944;0;STEADY FLIGHT
34440006;34:00.0;0.181725;-0.012534;0.949766;19;46.2;944;0;STEADY FLIGHT
"""
"""Lines of the real aircraft. Source: docs/explanation/task.md."""


def loaded(path: Path, stream: str | None = None, **names) -> LoadedFlight:
    return load_flight(SensorFile(path, Names(**names), stream), SETTINGS, 0.0)


def windows_of(flight: LoadedFlight) -> list[tuple[float, float, int | None]]:
    """Return opening and closing times [s] and the parabola of each window, as the product judges the samples."""
    watch, found = AircraftWatch(SETTINGS, 0.0), list[tuple[float, float, int | None]]()
    opened: tuple[float, int | None] = (0.0, None)
    for t, sample in flight.samples:
        watch, events = watch.with_sample(sample, t)
        for event in events:
            if isinstance(event, OpenWindow):
                assert event.since is not None
                opened = (event.since, event.parabola)
            elif isinstance(event, CloseWindow):
                found.append((opened[0], t, opened[1]))
    return found


def assert_both_windows_open_and_close(flight: LoadedFlight) -> None:
    found, cycle = windows_of(flight), CORNERS_S[-1]
    assert [parabola for *_, parabola in found] == [1, 2]
    # The level is within 0.1 g before the corner of the ramp from 1.8 to 0, which lasts 3 s; it is 0.2 g beyond after.
    early_s, late_s = 3.0 * 0.1 / 1.8, 3.0 * 0.2 / 1.8 + SETTINGS.dwell_s
    for k, (opened, closed, _) in enumerate(found):
        assert opened == pytest.approx(k * cycle + OPENS_S - early_s, abs=2.0 * FEED_S)
        assert closed == pytest.approx(k * cycle + CLOSES_S + late_s, abs=2.0 * FEED_S)


def frame(columns: list[str], scale: float = 1.0, time_scale: float = 1.0) -> pd.DataFrame:
    t, g = acceleration()
    return pd.DataFrame(np.column_stack([time_scale * t, scale * g]), columns=columns)


HEADS = {
    "a telephone's": (["Time (s)", "Acceleration x (m/s^2)", "Acceleration y (m/s^2)", "Acceleration z (m/s^2)"],
                      STANDARD_GRAVITY, 1.0),
    "a data logger's": (["timestamp [ms]", "AccX [g]", "AccY [g]", "AccZ [g]"], 1.0, 1e3),
    "a filtered flight's": (["t (s)", "g_x_filt (g)", "g_y_filt (g)", "g_z_filt (g)"], 1.0, 1.0),
    "an actigraph's": (["time [us]", "Accelerometer X [mg]", "Accelerometer Y [mg]", "Accelerometer Z [mg]"], 1e3, 1e6),
}  # fmt: skip


@pytest.mark.parametrize("head", HEADS)
def test_the_columns_of_many_loggers_are_found_by_their_names(tmp_path: Path, head: str):
    frame(*HEADS[head]).to_csv(tmp_path / "flight.csv", index=False)
    assert_both_windows_open_and_close(loaded(tmp_path / "flight.csv"))


def test_a_table_with_decimal_commas_a_preamble_and_other_sensors_is_read(tmp_path: Path):
    table = frame(["Time (s)", "Acc_X (g)", "Acc_Y (g)", "Acc_Z (g)"])
    for axis in "XYZ":
        table[f"Gyr_{axis} (deg/s)"] = 0.5
        table[f"Linear Acc_{axis} (g)"] = 0.0
    body = table.to_csv(sep=";", decimal=",", index=False)
    (tmp_path / "flight.txt").write_text(f"// Device: 00B42D4F\n// Started: 12:00\n{body}", encoding="utf-8-sig")
    assert_both_windows_open_and_close(loaded(tmp_path / "flight.txt"))


def test_dates_are_times(tmp_path: Path):
    table = frame(["timestamp", "acc_x [g]", "acc_y [g]", "acc_z [g]"])
    table["timestamp"] = pd.Timestamp("2026-11-29 09:30:00") + pd.to_timedelta(acceleration()[0], unit="s")
    table.to_csv(tmp_path / "flight.csv", index=False)
    flight = loaded(tmp_path / "flight.csv")
    assert_both_windows_open_and_close(flight)
    assert flight.samples[0][1].since_midnight_ms == 1000 * (9 * 3600 + 30 * 60)


def test_columns_and_units_that_the_file_does_not_name_are_given(tmp_path: Path):
    frame(["a", "b", "c", "d"], STANDARD_GRAVITY, 1e3).to_csv(tmp_path / "bare.csv", index=False, header=False)
    given = {"columns": ("1", "2", "3", "4"), "unit": "m/s2", "time_unit": "ms"}
    assert_both_windows_open_and_close(loaded(tmp_path / "bare.csv", **given))
    given = {"columns": ("2", "3", "4"), "unit": "m/s2", "rate_Hz": RATE_HZ}
    assert_both_windows_open_and_close(loaded(tmp_path / "bare.csv", **given))


def test_the_aircraft_s_own_lines_stay_as_they_are(tmp_path: Path):
    (tmp_path / "novespace.csv").write_text(f"{NOVESPACE}damaged;line\n")
    flight = loaded(tmp_path / "novespace.csv")
    assert [round(t, 3) for t, _ in flight.samples] == [0.0, 0.101, 0.199]
    assert flight.samples[2][1].announcement == "STEADY FLIGHT"
    assert flight.refused == 1


def test_a_published_sentence_of_a_real_sensor_is_read(tmp_path: Path):
    (tmp_path / "vn.log").write_text("\n".join([VECTORNAV] * 100))
    flight = loaded(tmp_path / "vn.log", rate_Hz=40.0)
    assert len(flight.samples) == 25
    assert flight.samples[0][1].norm_g == pytest.approx(9.948 / STANDARD_GRAVITY, abs=1e-4)


def test_damaged_sentences_are_counted_and_keep_their_place_in_time(tmp_path: Path):
    lines = [VECTORNAV] * 30 + [VECTORNAV.replace("+09.948", "+00.948")] * 40 + [VECTORNAV] * 30
    (tmp_path / "vn.log").write_text("\n".join(lines))
    flight = loaded(tmp_path / "vn.log", rate_Hz=40.0)
    assert (flight.refused, flight.gaps) == (40, 1)
    assert flight.samples[-1][0] == pytest.approx(2.4)


def test_a_matrix_of_matlab_is_read(tmp_path: Path):
    t, g = acceleration()
    savemat(tmp_path / "Ch32.mat", {"Low_g_Acceleration": np.vstack([t, g.T]), "Other": np.zeros((4, 9))})
    flight = loaded(tmp_path / "Ch32.mat", "Low_g_Acceleration", unit="g")
    assert_both_windows_open_and_close(flight)
    with pytest.raises(RecordingError, match=r"Low_g_Acceleration, Other\. Name one with --stream"):
        loaded(tmp_path / "Ch32.mat", unit="g")


def test_a_stream_of_an_xdf_file_is_read_beside_other_streams(tmp_path: Path):
    t, g = acceleration()
    imu = stream(1, "IMU", list(t + 50.0), g.tolist(), ("AccX", "AccY", "AccZ"), rate=RATE_HZ)
    path = write_xdf(tmp_path / "lab.xdf", imu, stream(2, "Keys", [51.0, 52.0], [["a"], ["b"]]))
    assert_both_windows_open_and_close(loaded(path, "IMU", unit="g"))
    with pytest.raises(RecordingError, match="Name that of the acceleration with --stream"):
        loaded(path, unit="g")
    with pytest.raises(RecordingError, match="holds texts, not numbers"):
        loaded(path, "Keys", unit="g")
    with pytest.raises(RecordingError, match="0 streams in the file are named 'Imu'"):
        loaded(path, "Imu", unit="g")


def test_vibration_does_not_open_or_close_a_window_and_gaps_stay_gaps(tmp_path: Path):
    table = frame(["Time (s)", "Acc X (g)", "Acc Y (g)", "Acc Z (g)"])
    gone = (table["Time (s)"] > 60.0) & (table["Time (s)"] < 64.0)
    table[~gone].to_csv(tmp_path / "gap.csv", index=False)
    flight = loaded(tmp_path / "gap.csv")
    assert flight.gaps == 1
    assert_both_windows_open_and_close(flight)


REFUSED = {
    "no unit": ("time [s],ax,ay,az\n", "No unit of acceleration is stated. Give it with --unit: g, mg, m/s2"),
    "no unit of time": (
        "time,ax [g],ay [g],az [g]\n",
        "Column 'time' states no unit of time. Give it with --time-unit",
    ),
    "no time": ("n,ax [g],ay [g],az [g]\n", "None of the columns n, ax .* is a time. Name it with --columns, or give"),
    "linear acceleration": ("time [s],lin_acc_x [g],lin_acc_y [g],lin_acc_z [g]\n", "three accelerations with gravity"),
    "no header": ("", "do not hold names of three acceleration columns; the file begins with '0.0,"),
}


@pytest.mark.parametrize("case", REFUSED)
def test_what_a_table_does_not_state_is_asked_for(tmp_path: Path, case: str):
    head, message = REFUSED[case]
    (tmp_path / "flight.csv").write_text(head + frame(["t", "x", "y", "z"]).to_csv(index=False, header=False))
    with pytest.raises(RecordingError, match=message):
        loaded(tmp_path / "flight.csv")


def test_a_wrong_unit_or_an_acceleration_without_gravity_is_refused(tmp_path: Path):
    head = ["Time (s)", "Acc X", "Acc Y", "Acc Z"]
    frame(head, STANDARD_GRAVITY).to_csv(tmp_path / "si.csv", index=False)
    with pytest.raises(RecordingError, match=r"median of the acceleration is .* g; that of a flight is about 1"):
        loaded(tmp_path / "si.csv", unit="g")
    with pytest.raises(RecordingError, match=r"usable samples|without gravity"):
        loaded(tmp_path / "si.csv", unit="mg")
    frame(head, 0.1).to_csv(tmp_path / "linear.csv", index=False)
    with pytest.raises(RecordingError, match="without gravity"):
        loaded(tmp_path / "linear.csv", unit="g")
    with pytest.raises(RecordingError, match="samples per second; at least 5 are needed"):
        loaded(tmp_path / "linear.csv", unit="g", columns=("2", "3", "4"), rate_Hz=1.0)


def test_other_files_are_refused_with_their_path(tmp_path: Path):
    for name, content in (("a.csv", b""), ("b.csv", b"Dear all,\nhow are you?\n"), ("c.csv", b"\xff\xfe\x00\x01" * 9),
                          ("d.mat", b"no matrix"), ("e.xdf", b"Dear all")):  # fmt: skip
        (tmp_path / name).write_bytes(content)
        with pytest.raises(RecordingError):
            loaded(tmp_path / name, "IMU")
    with pytest.raises(RecordingError, match="No such file"):
        loaded(tmp_path / "none.csv")
    (tmp_path / "vn.log").write_text(VECTORNAV)
    with pytest.raises(RecordingError, match="Give their rate with --rate"):
        loaded(tmp_path / "vn.log")
