"""EEG and EMG are exported as their own data types, at their true time and to 0.1 µV; or the reason is told."""

import json
import warnings
from pathlib import Path

import mne_bids
import numpy as np
import pytest

from exograv.study.bids.biosignals import ROWS_AT_ONCE
from exograv.study.bids.checking import read_rows
from exograv.study.bids.devices import DeviceFiles, Devices
from exograv.study.bids.names import SessionPlace
from exograv.study.folder.stream_settings import StreamSettings

from .made_up_biosignal import AMPLITUDE_UV, BEGINS_S, TOPIC, MadeUpDevice, lags_of, truth

PLACE = SessionPlace("K7MR4XP", "training01")
LAG_MAX_S = 1e-3
"""Largest accepted delay of an exported signal on the session's clock [s]."""


def written(root: Path, device: MadeUpDevice, stated: dict[str, StreamSettings] | None = None) -> DeviceFiles:
    root.mkdir(exist_ok=True)
    with Devices(root, PLACE, device.recording(), BEGINS_S, stated or {}) as devices:
        for block in device.blocks():
            devices.take(TOPIC, block)
        return devices.finish({"TaskName": "pointing"})


def opened(root: Path, files: DeviceFiles) -> tuple[np.ndarray, np.ndarray, dict]:
    """Return times on the session's clock [s], values [µV] by MNE-BIDS, and the sidecar."""
    (file,) = files.biosignals
    about = json.loads((root / file.table).with_suffix(".json").read_text())
    path = mne_bids.BIDSPath(
        subject=PLACE.subject, session=PLACE.session, task="pointing", datatype=file.kind.lower(), root=root
    )
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", "Did not find any events.tsv")  # write_session writes the events
        raw = mne_bids.read_raw_bids(path, verbose="ERROR")
    return file.first_t + raw.times, 1e6 * raw.get_data(), about


def outside_gaps(t: np.ndarray, files: DeviceFiles) -> np.ndarray:
    is_there = np.ones(len(t), bool)
    for gap in files.biosignals[0].gaps:
        is_there &= (t < gap.t - 0.2) | (t > gap.t + gap.seconds + 0.2)
    return is_there


@pytest.mark.long
def test_over_an_hour_with_drift_jitter_losses_and_another_connection_the_lag_stays_below_1_ms(tmp_path: Path):
    device = MadeUpDevice(
        seconds=3600.0,
        jitter_s=2e-3,
        lost=((600.0, 600.012), (1200.0, 1205.0), (1900.0, 1900.1), (2700.0, 2701.0)),
        reconnects_s=2700.5,
    )
    files = written(tmp_path, device)
    t, values, about = opened(tmp_path, files)
    is_there = outside_gaps(t, files)
    for channel in range(2):
        lags = lags_of(values[channel][is_there], t[is_there], 2500, channel)
        assert len(lags) > 300
        assert np.abs(lags).max() < LAG_MAX_S
    assert about["SamplingFrequency"] == 250
    rate = 250.0 * (1.0 + device.drift) * (1.0 + device.rig_drift)
    assert about["SamplingFrequencyEffective"] == pytest.approx(rate, rel=2e-6)
    assert about["RowsWithoutSample"] == pytest.approx(3 + 1250 + 25 + 250, abs=2)


@pytest.mark.parametrize("unit", ["uV", "mV", "V"])
def test_values_are_true_to_a_tenth_of_a_microvolt(tmp_path: Path, unit: str):
    t, values, about = opened(
        tmp_path, files := written(tmp_path, MadeUpDevice(unit=unit, seconds=100.0, correction_s=0.0))
    )
    inside = outside_gaps(t, files) & (t > t[0] + 0.2)
    # 50 ppm of drift over 100 s is a whole period, so that every position between two samples occurs.
    for channel in range(2):
        away = values[channel][inside] - truth(t[inside], channel)
        assert np.abs(away).max() < 0.1 + 1e-3 * AMPLITUDE_UV
    assert about["RoundingErrorMax_uV"] < 0.1


def test_a_value_is_rounded_by_less_than_a_tenth_of_a_microvolt_on_an_offset_of_300_mV(tmp_path: Path):
    device = MadeUpDevice(drift=0.0, rig_drift=0.0, correction_s=0.0, seconds=30.0, unit="V")
    numbers = 0.3 + 1e-6 * np.random.default_rng(0).normal(0.0, 1.0, (len(device.t), 2))
    object.__setattr__(device, "values", lambda t: numbers[np.searchsorted(device.t, t - 1e-4)])
    _, values, about = opened(tmp_path, written(tmp_path, device))
    assert np.abs(values[:, 100:7000] - 1e6 * numbers.T[:, 100:7000]).max() < 0.1
    assert about["RoundingErrorMax_uV"] < 0.1


def test_the_interpolation_is_true_to_a_thousandth_up_to_0_8_of_half_the_rate(tmp_path: Path):
    device = MadeUpDevice(seconds=100.0)
    sine = lambda t: AMPLITUDE_UV * np.sin(2.0 * np.pi * 0.8 * 125.0 * t)  # noqa: E731
    object.__setattr__(device, "values", lambda t: np.column_stack([sine(t), sine(t)]))
    t, values, about = opened(tmp_path, files := written(tmp_path, device))
    inside = outside_gaps(t, files) & (t > t[0] + 0.2)
    fit, *_ = np.linalg.lstsq(
        np.column_stack([np.sin(2.0 * np.pi * 100.0 * t[inside]), np.cos(2.0 * np.pi * 100.0 * t[inside])]),
        values[0][inside],
    )
    assert np.hypot(*fit) == pytest.approx(AMPLITUDE_UV, rel=1e-3)
    assert about["SoftwareFilters"]["Interpolation"]["TrueTo_Hz"] == 100.0


def test_stamps_that_jitter_by_two_periods_lose_no_sample(tmp_path: Path):
    files = written(tmp_path, MadeUpDevice(jitter_s=8e-3, seconds=300.0))
    t, values, about = opened(tmp_path, files)
    assert about["RowsWithoutSample"] == about["SamplesLeftOut"] == 0
    inside = outside_gaps(t, files) & (t > t[0] + 0.2)
    assert np.abs(lags_of(values[0][inside], t[inside], 2500)).max() < LAG_MAX_S


@pytest.mark.parametrize("jitter_s", [2e-3, 8e-3])
@pytest.mark.parametrize("seed", range(3))
def test_beside_a_loss_jitter_makes_no_further_gaps(tmp_path: Path, seed: int, jitter_s: float):
    device = MadeUpDevice(jitter_s=jitter_s, seconds=90.0, lost=((30.0, 35.0), (60.0, 61.0)), seed=seed)
    files = written(tmp_path, device)
    *_, about = opened(tmp_path, files)
    assert about["RowsWithoutSample"] == pytest.approx(1250 + 250, abs=2)
    is_long = [gap.seconds > 0.9 for gap in files.biosignals[0].gaps if gap.t < 80.0]
    assert is_long == [True, True]


def test_a_part_without_samples_is_a_line_that_mne_leaves_out(tmp_path: Path):
    device = MadeUpDevice(seconds=60.0, lost=((30.0, 32.0),))
    files = written(tmp_path, device)
    gap = files.biosignals[0].gaps[0]
    assert (gap.t, gap.seconds) == (pytest.approx(30.0, abs=0.01), pytest.approx(2.0, abs=0.01))
    t, values, _ = opened(tmp_path, files)
    within = (t > gap.t) & (t < gap.t + gap.seconds - 0.01)
    assert np.abs(np.diff(values[0][within], 2)).max() < 0.01


def test_a_long_recording_is_written_in_parts_without_a_seam(tmp_path: Path):
    device = MadeUpDevice(seconds=2.5 * ROWS_AT_ONCE / 250.0, correction_s=0.0)
    t, values, _ = opened(tmp_path, files := written(tmp_path, device))
    inside = outside_gaps(t, files) & (t > t[0] + 0.2)
    assert np.abs(values[0][inside] - truth(t[inside])).max() < 0.2


def test_a_device_with_a_broken_rate_is_exported_at_the_next_whole_rate(tmp_path: Path):
    files = written(
        tmp_path, MadeUpDevice(kind="EMG", rate_Hz=34000.0 / 27.0, seconds=20.0, correction_s=0.0, labels=("BB", "TB"))
    )
    t, values, about = opened(tmp_path, files)
    inside = outside_gaps(t, files) & (t > t[0] + 0.2)
    assert about["SamplingFrequency"] == 1260
    assert np.abs(values[1][inside] - truth(t[inside], 1)).max() < 0.2


def test_what_bids_needs_comes_from_the_study_or_is_missing(tmp_path: Path):
    stated = {"EMG": StreamSettings(reference="bipolar", placement="SENIAM", power_line_Hz=50.0, muscles=["m", "n"])}
    files = written(tmp_path, MadeUpDevice(kind="EMG", labels=("BB", "TB")), stated)
    *_, about = opened(tmp_path, files)
    assert (about["EMGReference"], about["PowerLineFrequency"]) == ("bipolar", 50.0)
    assert (about["EMGPlacementScheme"], about["EMGPlacementSchemeDescription"]) == ("Other", "SENIAM")
    _, rows = read_rows(tmp_path / PLACE.biosignal("EMG", "", "channels.tsv"))
    assert [(row["name"], row["target_muscle"]) for row in rows] == [("BB", "m"), ("TB", "n")]
    assert files.biosignals[0].not_stated == []
    files = written(tmp_path / "bare", MadeUpDevice(kind="EMG", labels=("BB", "TB")))
    *_, about = opened(tmp_path / "bare", files)
    assert about["EMGReference"] == about["PowerLineFrequency"] == "n/a"
    assert files.biosignals[0].not_stated == ["reference", "placement", "power_line_Hz"]


def test_a_unit_of_the_study_replaces_that_of_the_stream(tmp_path: Path):
    device = MadeUpDevice(unit="counts", seconds=20.0, correction_s=0.0)
    assert "unit" in written(tmp_path / "a", device).left[0].why
    for name in ("EEG", "device of Mustermann"):
        root = tmp_path / name
        t, values, _ = opened(root, written(root, device, {name: StreamSettings(unit_uV=0.5)}))
        assert np.abs(values[0][200:4000] - 0.5 * truth(t[200:4000])).max() < 0.2


def test_a_type_in_small_letters_finds_the_statements_on_its_type(tmp_path: Path):
    device = MadeUpDevice(kind="emg", unit="counts", seconds=20.0)
    (file,) = written(tmp_path, device, {"EMG": StreamSettings(unit_uV=0.5)}).biosignals
    assert file.kind == "EMG"


def test_places_of_electrodes_are_those_of_the_stream(tmp_path: Path):
    place = "<location><X>1.5</X><Y>-20</Y><Z>90</Z></location>"
    written(tmp_path, MadeUpDevice(labels=("Cz", "Pz"), unit=f"uV</unit>{place}<unit>"))
    _, rows = read_rows(tmp_path / PLACE.biosignal("EEG", "", "electrodes.tsv"))
    assert [row["name"] for row in rows] == ["Cz", "Pz"]
    assert (rows[0]["x"], rows[0]["y"], rows[0]["z"]) == ("1.5", "-20", "90")
    axes = json.loads((tmp_path / PLACE.biosignal("EEG", "", "coordsystem.json")).read_text())
    assert axes["EEGCoordinateUnits"] == "mm"


def test_a_trigger_is_not_interpolated(tmp_path: Path):
    device = MadeUpDevice(labels=("Cz", "Trigger</label><type>TRIG</type><label>"), seconds=20.0)
    pulses = lambda t: np.column_stack([truth(t), 7.0 * (np.floor(t) % 2 == 0)])  # noqa: E731
    object.__setattr__(device, "values", pulses)
    _, values, _ = opened(tmp_path, written(tmp_path, device))
    assert set(np.unique(np.round(1e-6 * values[1], 3)).tolist()) <= {0.0, 7.0}


@pytest.mark.parametrize(
    ("device", "stated", "why"),
    [
        (MadeUpDevice(unit=""), StreamSettings(), "states none"),
        (MadeUpDevice(unit="counts"), StreamSettings(), "no voltage"),
        (MadeUpDevice(), StreamSettings(labels=["Cz"]), "2 channels, but `labels` in study.toml has 1"),
        (MadeUpDevice(), StreamSettings(muscles=["a"]), "2 channels, but `muscles` in study.toml has 1"),
        (MadeUpDevice(), StreamSettings(unit_uV=1e6), "too large"),
        (MadeUpDevice(lost=((20.0, 3700.0),), seconds=3720.0), StreamSettings(), "more than an hour"),
    ],
)
def test_a_stream_that_does_not_fit_is_a_physiological_recording_and_the_reason_is_told(
    tmp_path: Path, device: MadeUpDevice, stated: StreamSettings, why: str
):
    files = written(tmp_path, device, {"EEG": stated})
    assert files.biosignals == []
    assert why in files.left[0].why
    assert files.left[0].as_physio
    (table,) = files.physio
    assert (tmp_path / table).is_file()
    assert not (tmp_path / PLACE.folder / "eeg").exists()
